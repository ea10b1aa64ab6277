"""Predictor files: nothing is lost, nothing foreign or unproven gets in."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadriga.agents.planner.gates import run_gates
from quadriga.agents.predictor.fits import fit_ridge
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.agents.predictor.store import Provenance, load, predictor_sha256, read, save, versions
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError

Team = Callable[..., Any]


@pytest.fixture(scope="module")
def plant(small: Config) -> Config:
    return replace(small, controller=replace(small.controller, ki_z=0.0))


@pytest.fixture(scope="module")
def fitted(plant: Config, linear_team: Team) -> tuple[Predictor, Provenance]:
    team = linear_team(2)
    predictor = fit_ridge([team.episode(900, 1)], PredictorMeta.of(plant))
    report = run_gates(plant, predictor, [team.episode(100, 2)])
    return predictor, Provenance("abc", (1,), (900,), (100,), versions(), report)


@pytest.fixture
def stored(tmp_path: Path, fitted: tuple[Predictor, Provenance]) -> Path:
    path = tmp_path / "cache" / "predictor.npz"
    save(path, *fitted)
    return path


def test_what_is_saved_is_loaded(
    stored: Path, plant: Config, fitted: tuple[Predictor, Provenance]
) -> None:
    predictor, provenance = load(stored, plant)
    assert predictor.G.tobytes() == fitted[0].G.tobytes()
    assert predictor.meta == fitted[0].meta
    assert provenance == fitted[1]
    assert {"python", "numpy", "scipy"} <= provenance.versions.keys()
    assert list(stored.parent.iterdir()) == [stored]


def test_the_digest_is_of_the_content(tmp_path: Path, fitted: tuple[Predictor, Provenance]) -> None:
    predictor, provenance = fitted
    elsewhere = replace(provenance, config_digest="another machine")
    digests = {save(tmp_path / name, predictor, elsewhere) for name in ("a.npz", "b.npz")}
    assert digests == {predictor_sha256(predictor)}
    assert read(tmp_path / "a.npz")[1].config_digest == "another machine"
    nudged = predictor.G.copy()
    nudged[0, 0, 1, 2, 3] = np.nextafter(nudged[0, 0, 1, 2, 3], np.inf)
    assert predictor_sha256(Predictor(predictor.meta, nudged)) not in digests
    other = replace(predictor.meta, stance_ms=150)
    assert predictor_sha256(Predictor(other, predictor.G)) not in digests


def test_a_missing_file_tells_how_to_get_one(tmp_path: Path, plant: Config) -> None:
    with pytest.raises(PredictorError, match=r"got no such file.*`quadriga fit`"):
        load(tmp_path / "none.npz", plant)


@pytest.mark.parametrize("content", [b"", b"hello", b"PK\x03\x04 not really", b"\x93NUMPY\x01\x00"])
def test_a_file_that_is_no_predictor(tmp_path: Path, plant: Config, content: bytes) -> None:
    path = tmp_path / "x.npz"
    path.write_bytes(content)
    with pytest.raises(PredictorError, match="expected a predictor that quadriga wrote"):
        load(path, plant)


def test_a_directory_is_no_predictor(tmp_path: Path, plant: Config) -> None:
    with pytest.raises(PredictorError, match="expected a predictor that quadriga wrote"):
        load(tmp_path, plant)


def test_an_archive_of_something_else(tmp_path: Path, plant: Config) -> None:
    np.savez(tmp_path / "x.npz", A=np.eye(3))
    with pytest.raises(PredictorError, match="KeyError"):
        load(tmp_path / "x.npz", plant)
    np.savez(tmp_path / "y.npz", G=np.eye(3), document=np.array("[1, 2]"))
    with pytest.raises(PredictorError, match="expected a predictor that quadriga wrote"):
        load(tmp_path / "y.npz", plant)


@pytest.mark.parametrize("kept", [0.1, 0.5, 0.95, 0.999])
def test_a_truncated_file(stored: Path, plant: Config, kept: float) -> None:
    content = stored.read_bytes()
    stored.write_bytes(content[: int(kept * len(content))])
    with pytest.raises(PredictorError, match="truncated or not a predictor"):
        load(stored, plant)


def rewritten(stored: Path, change: Callable[[dict[str, Any]], None]) -> Path:
    """The same file with another document, as someone with an editor would leave it."""
    with np.load(stored) as archive:
        G, document = archive["G"], json.loads(str(archive["document"]))
    change(document)
    np.savez(stored, G=G, document=np.array(json.dumps(document)))
    return stored


def test_content_that_was_changed(stored: Path, plant: Config) -> None:
    path = rewritten(stored, lambda document: document["meta"].update(stance_ms=150))
    with pytest.raises(PredictorError, match="digest does not match"):
        load(path, plant)


def test_another_format(stored: Path, plant: Config) -> None:
    path = rewritten(stored, lambda document: document.update(format=1))
    with pytest.raises(PredictorError, match="got format 1, expected format 2"):
        load(path, plant)


def test_a_predictor_without_gates(stored: Path, plant: Config) -> None:
    path = rewritten(stored, lambda document: document["provenance"].update(gates={}))
    with pytest.raises(PredictorError, match="expected a predictor that quadriga wrote"):
        load(path, plant)


@pytest.mark.parametrize(
    ("section", "changes", "message"),
    [
        ("team", {"robots": 3}, "robots: got 2, expected 3 as configured"),
        ("team", {"yokes": "chain"}, "yokes: got 'complete', expected 'chain'"),
        ("team", {"alternate_phase": False}, "alternate_phase: got True, expected False"),
        ("gait", {"stance_ms": 150}, "stance_ms: got 200, expected 150"),
        ("planner", {"N": 20}, "N: got 8, expected 20"),
        ("planner", {"T_ini": 12}, "T_ini: got 4, expected 12"),
        ("planner", {"interface": "force"}, "interface: got 'feedforward', expected 'force'"),
        ("controller", {"kp_z": 100.0}, r"controller\.kp_z: got 400\.0, expected 100\.0"),
    ],
)
def test_a_foreign_predictor_is_refused_by_name(
    stored: Path, plant: Config, section: str, changes: dict[str, Any], message: str
) -> None:
    foreign = replace(plant, **{section: replace(getattr(plant, section), **changes)})
    with pytest.raises(PredictorError, match=f"{message}.*`quadriga fit`"):
        load(stored, foreign)


def test_what_does_not_touch_the_plant_may_differ(stored: Path, plant: Config) -> None:
    other = replace(
        plant,
        controller=replace(plant.controller, damping=3.0),
        world=replace(plant.world, seed=7, terrain="boxes"),
    )
    load(stored, other)


def test_gates_hold_against_the_limits_in_force(stored: Path, plant: Config) -> None:
    strict = replace(plant.identification, gain_range=(1.5, 2.0))
    with pytest.raises(PredictorError, match="height gain of r1"):
        load(stored, replace(plant, identification=strict))


def test_other_weights_are_gated_anew(stored: Path, plant: Config) -> None:
    """The radius belongs to Q and R; with forces made cheap the plans fight harder."""
    before = load(stored, plant)[1].gates.radius
    cheap = replace(plant, planner=replace(plant.planner, R=(1e-7, 1e-7, 1e-7)))
    loose = replace(plant.identification, max_radius=10.0)
    after = load(stored, replace(cheap, identification=loose))[1].gates
    assert after.radius > 2 * before
    assert after.R == (1e-7, 1e-7, 1e-7)
    between = replace(plant.identification, max_radius=0.5 * (before + after.radius))
    load(stored, replace(plant, identification=between))
    with pytest.raises(PredictorError, match="radius of the best-response map"):
        load(stored, replace(cheap, identification=between))


def test_a_place_that_cannot_be_written(
    tmp_path: Path, fitted: tuple[Predictor, Provenance]
) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(PredictorError, match="expected a file that can be written"):
        save(tmp_path / "file" / "predictor.npz", *fitted)


def test_the_file_is_an_ordinary_archive(stored: Path) -> None:
    assert sorted(zipfile.ZipFile(stored).namelist()) == ["G.npy", "document.npy"]
