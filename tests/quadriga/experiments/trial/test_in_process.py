"""A trial over the bus and the same trial in one process: equal to the byte, and in figures."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import pytest

from quadriga.agents.predictor.gates import load_checked
from quadriga.agents.predictor.store import predictor_sha256
from quadriga.experiments.trial.figures_of_merit import Figures, compute_figures
from quadriga.experiments.trial.in_process import build_timed_agents, roll_out
from quadriga.experiments.trial.over_bus import walk_over_bus
from quadriga.identification.predictors import fit
from quadriga.identification.rollout import Tick
from quadriga.shared.codec import encode
from quadriga.shared.errors import ConfigError
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import GRAVITY
from tests.a1 import TOTAL_MASS
from tests.quadriga.linear_data import config_of, dataset


def untimed(found: Figures) -> Figures:
    """Without what depends on the machine, and what only the simulator knows."""
    return replace(
        found,
        planner_ms_median=None,
        planner_ms_p99=None,
        solves=0,
        work=None,
        cost_of_transport=None,
    )


def test_over_the_bus_a_trial_comes_to_the_same(tmp_path: Path) -> None:
    """Two robots that plan with each other's plans, each a process of its own, on rough ground."""
    config = config_of(
        world__duration=1.4,
        world__seed=3,
        world__terrain="boxes",
        world__terrain_height=0.05,
        world__payload=3.0,
        world__push="r2:60:90:0.6:0.2",
    )
    path, run_dir = tmp_path / "predictor.npz", tmp_path / "run"
    sha256 = predictor_sha256(fit(config, dataset(), path)[0])
    sent: defaultdict[str, list[bytes]] = defaultdict(list)

    def watch(tick: Tick) -> None:
        for name, out in tick.outputs.items():
            for topic in ("command", "measurement", "plan"):
                if (message := getattr(out, topic)) is not None:
                    sent[f"team/{name}/{topic}"].append(encode(message))

    agents = build_timed_agents(config, load_checked(path, config)[0])
    alone = compute_figures(roll_out(config, agents, None, watch))
    assert alone.cost is not None
    assert alone.plans
    together = compute_figures(walk_over_bus(config, run_dir, path, sha256))
    assert untimed(together) == untimed(alone)
    recorded: defaultdict[str, list[bytes]] = defaultdict(list)
    for entry in Recording(run_dir / "run.mcap").entries():
        recorded[entry.key].append(entry.payload)
    assert len(sent["team/r2/command"]) == 1400
    assert len(sent["team/r2/plan"]) == (1400 - 320) // 40
    for key, payloads in sent.items():
        assert recorded[key] == payloads, key
    with pytest.raises(ConfigError, match="a folder with a recording"):
        walk_over_bus(config, run_dir, path, sha256)


def test_the_motors_work_is_that_of_a_trot() -> None:
    """The cost of transport of a trot; and robots that merely stand do next to nothing."""
    config = config_of(planner__kind="none", world__duration=3.0)
    found = compute_figures(roll_out(config, build_timed_agents(config, None), None))
    assert found.work is not None
    assert found.distance is not None
    assert found.cost_of_transport is not None
    assert found.distance == pytest.approx(0.5 * 2.5, rel=0.1)
    weight = 2 * TOTAL_MASS * GRAVITY
    assert found.cost_of_transport == pytest.approx(found.work / (weight * found.distance))
    assert 0.3 < found.cost_of_transport < 3.0
    config = config_of(planner__kind="none", world__duration=0.5, gait__stand_ms=1000)
    still = compute_figures(roll_out(config, build_timed_agents(config, None), None))
    assert still.work is not None
    assert still.work < 0.05 * found.work
    assert still.cost_of_transport is None
