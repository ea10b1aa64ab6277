"""The main job with everything real: predictor, planners, estimator, bus, recording."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from quadriga.agents.gait import horizon_stance
from quadriga.identification.predictors import ensure_predictor
from quadriga.replay.team_replay import replay
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Plan
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import robot_names
from quadriga.team.launch import QUADRIGA
from tests.a1 import nominal_forces
from tests.runtime.conftest import DATA

pytestmark = pytest.mark.usefixtures("_compiled")

ROBOTS, SECONDS = 2, 5.0
STEP_MS = 40


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run folder of a walk as a user starts it."""
    ensure_predictor(load(None, {"team.robots": ROBOTS, **DATA}), Console(stderr=True))
    out = tmp_path_factory.mktemp("walk") / "run"
    words = ("--robots", str(ROBOTS), "--seconds", str(SECONDS), "--seed", "3", "--no-report")
    keys = (f"--set={key}={value}" for key, value in DATA.items())
    command = (*QUADRIGA, "walk", *words, *keys, "--out", str(out))
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return out


def plans(folder: Path) -> dict[str, list[Plan]]:
    """All plans of a walk by robot, in the order in which they were sent."""
    recording = Recording(folder / "run.mcap")
    return {name: list(recording.messages(Plan, name)) for name in robot_names(ROBOTS)}


def test_the_team_walks_within_its_tolerances(walk: Path) -> None:
    figures = json.loads((walk / "summary.json").read_text(encoding="utf-8"))
    rmse = figures["rmse"]
    assert not figures["fell"]
    assert figures["gaps"] == 0
    assert figures["mean_vx"] == pytest.approx(0.5, abs=0.02)
    assert rmse["vx"] <= 0.03
    assert rmse["z"] <= 0.010
    assert max(rmse["roll"], rmse["pitch"]) <= 0.04
    assert figures["yoke_drift_max"] <= 0.002


def test_every_plan_used_its_peer_s_plan_of_the_step_before(walk: Path) -> None:
    for name, of_robot in plans(walk).items():
        peer = "r2" if name == "r1" else "r1"
        steps = [plan.step for plan in of_robot]
        assert steps == list(range(steps[0], steps[0] + len(steps)))
        assert of_robot[0].used == {}
        for plan in of_robot[1:]:
            assert plan.used == {peer: plan.step - 1}
            assert plan.tick == STEP_MS * plan.step


def test_every_plan_is_within_the_friction_cone(walk: Path) -> None:
    config: Config = load(None, {"team.robots": ROBOTS, **DATA})
    cone = config.planner.mu / np.sqrt(2.0)
    for index, of_robot in enumerate(plans(walk).values()):
        assert {plan.status for plan in of_robot} == {"solved"}
        assert any(
            np.abs(plan.u - nominal_forces(horizon_stance(config, index, plan.step))).max() > 0.1
            for plan in of_robot
        )
        for plan in of_robot:
            stance = horizon_stance(config, index, plan.step)
            forces = plan.u.reshape(-1, 4, 3)
            assert not forces[~stance].any()
            fx, fy, fz = forces[stance].T
            assert fz.min() >= -1e-6
            assert np.all(np.abs(fx) <= cone * fz + 1e-6)
            assert np.all(np.abs(fy) <= cone * fz + 1e-6)


def test_a_run_folder_is_all_that_a_replay_needs(
    walk: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    run = walk / "run.mcap"
    (outcome,) = replay(run, ("r2",), {}, None, None, Console(stderr=True))
    assert outcome.verdict.exact
    assert outcome.verdict.equal["command"] == 1000 * SECONDS
