"""What `quadriga fit` tells: figures that agree with each other, files, and what is refused."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from rich.console import Console

from quadriga.agents.predictor.episode import Y_SCALE
from quadriga.agents.predictor.gates import read
from quadriga.agents.predictor.predictor import KINDS
from quadriga.commands.parser import main
from quadriga.identification import fit_report
from quadriga.identification.cache import predictor_path
from quadriga.identification.fit_report import (
    FitReport,
    Unfit,
    build_comparison,
    build_report_tables,
    report_fit,
)
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError
from quadriga.shared.robots.conventions import OUTPUTS
from tests.quadriga.linear_data import arguments, config_of, dataset, put_data

Said = pytest.CaptureFixture[str]


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A cache folder of this module's own with the linear team's data."""
    folder = tmp_path_factory.mktemp("cache")
    with pytest.MonkeyPatch.context() as patch:
        put_data(folder, patch)
        yield folder


def reported(config: Config) -> FitReport:
    kind = config.identification.predictor
    report = report_fit(config, dataset(), kind, Console(stderr=True))
    assert isinstance(report, FitReport)
    return report


@pytest.mark.parametrize("kind", ["ridge", "periodic"])
def test_errors_over_the_horizon_make_up_the_error_of_the_gates(kind: str) -> None:
    found = reported(config_of(identification__predictor=kind))
    assert found.rmse.shape == found.persistence.shape == (8, 6)
    ours, theirs = (
        np.linalg.norm(np.sqrt((errors**2).mean(axis=0)) / Y_SCALE)
        for errors in (found.rmse, found.persistence)
    )
    assert found.gates.error == pytest.approx(ours / theirs, rel=1e-12)


def test_persistence_is_the_change_since_the_last_sample() -> None:
    """Against the definition written out for one sample of the horizon."""
    y = dataset().held_out[0].y
    last, third = y[3 : len(y) - 8], y[3 + 3 : len(y) - 8 + 3]
    expected = np.sqrt(((third - last) ** 2).mean(axis=(0, 1)))
    np.testing.assert_allclose(reported(config_of()).persistence[2], expected)


def test_the_report_is_printed_and_kept_beside_the_predictor(capsys: Said) -> None:
    assert main(["fit", *arguments()]) == 0
    out = capsys.readouterr().out
    path = predictor_path(config_of())
    assert out.splitlines()[-1] == str(path)
    for phrase in ("radius of the iteration", "persistence", "Coupling", "digest", "seeds 5 … 6"):
        assert phrase in out
    kept = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
    predictor, provenance = read(path)
    assert kept["refused"] == ""
    assert kept["provenance"]["fit_seconds"] > 0.0
    assert kept["provenance"] == json.loads(json.dumps(asdict(provenance)))
    assert kept["sha256"][:16] in out
    assert {name: len(found) for name, found in kept["horizon"]["rmse"].items()} == dict.fromkeys(
        OUTPUTS, predictor.meta.N
    )
    page = path.with_suffix(".md").read_text(encoding="utf-8")
    assert f"({path.stem}.png)" in page
    assert path.with_suffix(".png").read_bytes().startswith(b"\x89PNG")


def test_a_predictor_that_is_there_is_reported_as_it_was(capsys: Said) -> None:
    assert main(["fit", *arguments()]) == 0
    before = predictor_path(config_of()).stat().st_mtime_ns
    first = capsys.readouterr().out
    assert main(["fit", *arguments()]) == 0
    assert capsys.readouterr().out == first
    assert predictor_path(config_of()).stat().st_mtime_ns == before


def test_a_refused_predictor_is_shown_with_the_figure_that_refused_it(capsys: Said) -> None:
    limits = {"identification__max_radius": 0.01}
    assert main(["fit", *arguments(**limits)]) == 2
    out, err = capsys.readouterr()
    path = predictor_path(config_of(**limits))
    kept = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
    radius = kept["provenance"]["gates"]["radius"]
    assert f"refused: radius of the best-response map {radius:.3f}, not below 0.01" in out
    assert f"got {radius:.3f}, expected below 0.01" in err
    assert err.count("\n") == 1
    assert not path.exists()


def test_every_predictor_is_compared_and_the_refused_ones_are_not_hidden(capsys: Said) -> None:
    """Between the radii of two fits of the same data lies a limit that refuses one of them."""
    weight = {"identification__block_weight": 1000.0}
    weighted, plain = (
        reported(config_of(**weight, identification__predictor=kind)) for kind in ("ridge", "pinv")
    )
    limit = (weighted.gates.radius + plain.gates.radius) / 2
    limits = weight | {"identification__max_radius": limit}
    config = config_of(**limits)
    status = main(["fit", "--all", *arguments(**limits)])
    out, err = capsys.readouterr()
    assert status == 0, err
    path = predictor_path(config)
    assert out.splitlines()[-1] == str(path)
    kept = json.loads(path.with_name(f"{path.stem}-all.json").read_text(encoding="utf-8"))
    by_name = {report["predictor"]: report for report in kept}
    assert list(by_name) == list(KINDS)
    assert by_name["ridge"]["refused"] == ""
    assert "radius" in by_name["pinv"]["refused"]
    for name, report in by_name.items():
        assert f"{name}: refused: {report['refused']}."[:60] in out or not report["refused"]
        ident = replace(config.identification, predictor=name)
        file = predictor_path(replace(config, identification=ident))
        assert file.exists() == (not report["refused"])
    assert path.with_name(f"{path.stem}-all.png").exists()


def test_what_cannot_be_fitted_at_all_is_a_row_with_the_reason() -> None:
    report = reported(config_of())
    singular = Unfit("pinv", PredictorError("normal equations", "a pivot of 0", "positive"))
    table = build_comparison([report, singular])
    assert all(len(row) == len(table.columns) for row in table.rows)
    assert (table.rows[1][0], table.rows[1][-1]) == ("pinv", "no fit")
    assert "pinv: refused: normal equations a pivot of 0, not positive." in table.notes
    for sheet in build_report_tables(report):
        assert all(len(row) == len(sheet.columns) for row in sheet.rows)


def test_data_that_do_not_excite_fit_nothing() -> None:
    still = tuple(replace(episode, u=episode.u_nominal.copy()) for episode in dataset().training)
    config, data = config_of(identification__ridge=2e-6), replace(dataset(), training=still)
    found = report_fit(config, data, "ridge", Console(stderr=True))
    assert isinstance(found, Unfit)
    assert "persistently exciting" in found.refused.expected


def test_degrees_stand_beside_milliradians(monkeypatch: pytest.MonkeyPatch) -> None:
    errors = {"rmse": np.full((5, 6), 0.02), "persistence": np.full((5, 6), np.deg2rad(2.0))}
    report = cast(FitReport, SimpleNamespace(name="ridge", refused=None, **errors))
    drawn = list[Figure]()
    monkeypatch.setattr(fit_report, "save_png", lambda figure, _path: drawn.append(figure))
    fit_report.draw([report], Path("fit.png"))
    (figure,) = drawn
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()

    def beside(axes: Any) -> list[str]:
        return [label.get_text() for other in axes.child_axes for label in other.get_yticklabels()]

    by_name = dict(zip(OUTPUTS, map(beside, figure.axes), strict=True))
    assert not by_name["z"] + by_name["vx"] + by_name["vy"]
    for name, sign in (("roll", "°"), ("pitch", "°"), ("wz", "°/s")):
        assert f"2{sign}" in by_name[name]
