"""A comparison as it is typed: real walks, refused predictors, nothing to resume, Ctrl-C."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from quadriga.commands.parser import main
from quadriga.experiments.compare_sheets import comparison_sheets
from quadriga.experiments.trial.trial import Figures, TrialResult
from quadriga.experiments.trial.trials import Trial
from quadriga.shared.robot.a1 import OUTPUTS
from quadriga.shared.runtime.clock import monotonic, sleep
from tests.quadriga.linear_data import arguments, put_data

Said = pytest.CaptureFixture[str]


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A cache folder of this module's own with the linear team's data."""
    folder = tmp_path_factory.mktemp("cache")
    with pytest.MonkeyPatch.context() as patch:
        put_data(folder, patch)
        yield folder


def test_planners_walk_in_the_same_world(capsys: Said, tmp_path: Path) -> None:
    """Two robots for 1.4 s, of which the last 0.1 s are the steady part."""
    out = tmp_path / "comparison"
    status = main(
        [
            "compare",
            "--planners",
            "none,distributed,deepc",
            "--predictors",
            "ridge",
            "--seeds",
            "3",
            "--seconds",
            "1.4",
            "--jobs",
            "1",
            "--out",
            str(out),
            *arguments(),
        ]
    )
    told = capsys.readouterr()
    assert status == 0, told.err
    kept = json.loads((out / "compare.json").read_text(encoding="utf-8"))
    rows = {(t["trial"]["planner"], t["trial"]["predictor"]): t for t in kept["trials"]}
    assert list(rows) == [("none", ""), ("distributed", "ridge"), ("deepc", "ridge")]
    assert set(kept["predictors"]) == {"ridge"}
    for (planner, _), row in rows.items():
        found = row["figures"]
        assert row["refused"] == ""
        assert found["seconds"] == 1.39  # the last sample before the end
        assert found["fallen"] == found["stopped"] == {}
        assert found["mean"]["z"] == pytest.approx(0.26, abs=0.02)
        assert found["cost"] == pytest.approx(found["cost_outputs"] + found["cost_forces"])
        steps = 0 if planner == "none" else (1400 - 320) // 40  # from 0.32 s to just before 1.4 s
        assert sum(found["plans"].values()) == 2 * steps
        assert found["solves"] == (steps if planner == "deepc" else 2 * steps)
        assert (found["planner_ms_p99"] is not None) == (steps > 0)
    assert rows["none", ""]["figures"]["cost_forces"] == pytest.approx(0.0, abs=1e-9)
    assert rows["distributed", "ridge"]["figures"]["cost_forces"] > 1e-3
    assert "| distributed · ridge |" in (out / "compare.md").read_text(encoding="utf-8")
    assert "Closed loop, flat" in told.out
    assert (out / "compare.png").read_bytes().startswith(b"\x89PNG")


def test_a_refused_predictor_is_a_row_with_the_reason(capsys: Said, tmp_path: Path) -> None:
    """No fit without block weights has so small a radius; the central planner does not mind."""
    out = tmp_path / "comparison"
    options = arguments(identification__max_radius=0.01, identification__block_weight=1.0)
    status = main(
        [
            "compare",
            "--planners",
            "distributed,centralised",
            "--predictors",
            "pinv",
            "--seeds",
            "0:2",
            "--seconds",
            "0.5",
            "--jobs",
            "1",
            "--out",
            str(out),
            *options,
        ]
    )
    told = capsys.readouterr()
    assert status == 0, told.err
    kept = json.loads((out / "compare.json").read_text(encoding="utf-8"))
    assert len(kept["trials"]) == 3 * 2
    for row in kept["trials"]:
        alone = row["trial"]["planner"] == "distributed"
        assert ("radius of the best-response map" in row["refused"]) == alone
        assert (row["figures"] is None) == alone
    assert "distributed · pinv: refused: radius" in told.out


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--planners", "clever"], "--planners: got 'clever', expected names of none, decentr"),
        (["--predictors", "?"], "--predictors: got '?', expected names of pinv"),
        (["--scenarios", "moon"], "--scenarios: got 'moon'"),
        (["--seeds", "3:1"], "--seeds: got '3:1', expected at least one seed"),
        (["--seeds", "x"], "--seeds: got 'x'"),
        (["--jobs", "0"], "--jobs: got 0, expected at least 1"),
        (["--out", "/proc/comparison"], "--out /proc/comparison"),
    ],
)
def test_mistakes_cost_one_line(capsys: Said, options: list[str], message: str) -> None:
    assert main(["compare", *options]) == 2
    out, err = capsys.readouterr()
    assert message in err
    assert err.count("\n") == 1
    assert out == ""


def test_data_that_cannot_be_used_cost_one_line(capsys: Said, tmp_path: Path, cache: Path) -> None:
    (data,) = cache.rglob("data-*.npz")
    whole = data.read_bytes()
    try:
        data.write_bytes(b"nothing")
        assert main(["compare", "--out", str(tmp_path), *arguments()]) == 2
    finally:
        data.write_bytes(whole)
    assert f"data {data}: got" in capsys.readouterr().err


def test_a_folder_with_a_comparison_is_neither_resumed_nor_overwritten(
    capsys: Said, tmp_path: Path
) -> None:
    kept = tmp_path / "compare.json"
    kept.write_text("{}", encoding="utf-8")
    assert main(["compare", "--out", str(tmp_path), *arguments()]) == 2
    assert "a folder with a comparison" in capsys.readouterr().err
    assert kept.read_text(encoding="utf-8") == "{}"


def children(pid: int) -> set[int]:
    """Processes that a process has started and that still run, theirs included."""
    try:
        found = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split()
    except FileNotFoundError:
        return set()
    return {int(c) for c in found} | {d for c in found for d in children(int(c))}


def test_an_interrupt_leaves_no_worker_and_keeps_what_was_walked(tmp_path: Path) -> None:
    out = tmp_path / "comparison"
    process = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "quadriga",
            "compare",
            "--planners",
            "none",
            "--predictors",
            "ridge",
            "--seeds",
            "0:8",
            "--seconds",
            "30",
            "--jobs",
            "1",
            "--out",
            str(out),
            *arguments(),
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    deadline = monotonic() + 300.0  # that it ends is tested, not how soon
    while len(workers := children(process.pid)) < 2:  # a worker and the resource tracker
        assert process.poll() is None, process.communicate()[0]
        assert monotonic() < deadline
        sleep(0.02)
    process.send_signal(signal.SIGINT)
    said, _ = process.communicate(timeout=300.0)
    assert process.returncode == 130
    assert "Traceback" not in said
    while any(Path(f"/proc/{worker}").exists() for worker in workers):
        assert monotonic() < deadline
        sleep(0.02)
    assert json.loads((out / "compare.json").read_text(encoding="utf-8"))["trials"] == []


def row(planner: str, seed: int, cost: float | None, fell: float | None = None) -> TrialResult:
    """A walk whose outputs all have an RMSE of a hundredth of its cost."""
    rmse = dict.fromkeys(OUTPUTS, None if cost is None else cost / 100)
    fallen = {} if fell is None else {"r2": fell}
    found = Figures(8.0, fallen, {}, rmse, rmse, cost, cost, 0.0, 0.5, 1.0, 10, {"solved": 10})
    return TrialResult(Trial(planner, "" if planner == "none" else "ridge", "flat", seed), found)


def test_means_are_of_the_walks_without_a_fall_and_ratios_of_the_same_worlds() -> None:
    rows = [
        row("none", 0, 100.0), row("none", 1, 400.0), row("none", 2, None, 1.0),
        row("damped", 0, 50.0), row("damped", 1, 100.0), row("damped", 2, 1e6, 5.0),
    ]  # fmt: skip
    (sheet,) = comparison_sheets(rows)
    cell = {line[0]: dict(zip(sheet.columns, line, strict=True)) for line in sheet.rows}
    damped = cell["damped · ridge"]
    assert (cell["none"]["fell"], damped["fell"]) == ("1/3", "1/3")
    assert (cell["none"]["cost"], damped["cost"]) == ("250", "75")
    assert damped["/ none"] == f"{(0.5 + 0.25) / 2:.2f}"
    assert damped["z [mm]"] == "750.0"
    assert damped["plans"] == "solved 100 %"
    assert "damped · ridge, seed 2: r2 fell at 5.00 s." in sheet.notes


def test_a_walk_that_failed_is_counted_and_named() -> None:
    failed = replace(row("damped", 2, None), figures=None, failed="process r2: got signal 9")
    (sheet,) = comparison_sheets([row("damped", 0, 50.0), failed])
    assert sheet.rows[0][1] == "0/2, 1 failed"
    assert "damped · ridge, seed 2: failed: process r2: got signal 9." in sheet.notes
