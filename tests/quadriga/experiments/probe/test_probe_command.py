"""`quadriga probe` from its options to its files, with a real team."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from quadriga.commands.parser import main
from quadriga.identification.cache import predictor_path
from quadriga.shared.robots.conventions import OUTPUTS
from tests.quadriga.linear_data import arguments, config_of, put_data

MAPS = (
    "own_error", "own_size", "own_scatter", "peers_error", "peers_size", "peers_scatter",
    "peers_share_true", "peers_share_predicted",
)  # fmt: skip


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache folder with the linear team's data in it."""
    put_data(tmp_path / "cache", monkeypatch)
    return tmp_path / "cache"


def test_a_probe_measures_once_and_compares_any_predictors(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, keys = tmp_path / "first", [*arguments(), "--seed", "50910", "--jobs", "1"]
    assert main(["probe", *keys, "--repetitions", "1", "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "ridge: peers' error" in said
    assert said.splitlines()[-1] == str(out / "probe.md")
    found = json.loads((out / "probe.json").read_text())
    for name in MAPS:
        assert list(found[name]) == list(OUTPUTS), name
    assert all(found["own_error"][name] > 0.0 for name in OUTPUTS)
    assert found["seeds"] == [50910]
    assert found["own_scatter"]["z"] is None, "one world has no scatter"
    assert [phase["phase_ms"] for phase in found["phases"]] == list(range(20, 400, 40))
    assert list(found["directions"]) == found["pulse"]["directions"]
    assert [(p["pulse"], p["response"]) for p in found["pairs"]] == [("r2", "r1"), ("r1", "r2")]
    assert found["pulses"] == 10 * 2 * 5
    assert (out / "probe.png").stat().st_size > 10_000

    # Nothing is measured twice; the file and the name are the same predictor.
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "cache").rglob("responses-*")}
    assert len(kept) == 1
    again, file = tmp_path / "second", str(predictor_path(config_of()))
    options = ["--predictors", "ridge,pinv", "--predictor", file]
    assert main(["probe", *keys, "--repetitions", "1", *options, "--out", str(again)]) == 0
    assert all(path.stat().st_mtime_ns == time for path, time in kept.items())
    second = json.loads((again / "probe.json").read_text())
    first, pinv, of_file = second["predictors"]
    assert first["sha256"] == of_file["sha256"] == found["sha256"]
    assert first["own_error"] == of_file["own_error"] == found["own_error"]
    assert pinv["predictor"] == "pinv"
    assert pinv["own_error"] != found["own_error"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--repetitions", "0"], "--repetitions: got 0, expected at least 1"),
        (["--jobs", "0"], "--jobs: got 0, expected at least 1"),
        (["--predictors", "rigde"], "--predictors: got 'rigde', expected names of pinv"),
        (["--predictors", "pinv,pinv"], "--predictors: got pinv, pinv, expected each once"),
        (["--predictor", "/nowhere/p.npz"], "predictor /nowhere/p.npz: got no such file"),
    ],
)
def test_a_mistake_is_one_line(
    options: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["probe", *arguments(), *options]) == 2
    assert message in capsys.readouterr().err


def test_a_predictor_of_another_team_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fit", *arguments()]) == 0
    path = str(predictor_path(config_of()))
    capsys.readouterr()
    assert main(["probe", "--robots", "3", "--predictor", path]) == 2
    assert "robots: got 2, expected 3 as configured" in capsys.readouterr().err
