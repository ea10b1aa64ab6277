"""A rehearsal goes through everything that a walk may come to."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from quadriga.agents.agent import Agent
from quadriga.agents.planner.planner import Planner
from quadriga.agents.rehearsal import rehearse
from quadriga.shared.config.sections import Config, TeamConfig
from quadriga.shared.modes import WALK
from tests.agents.counting import count_calls
from tests.agents.duet import simple_predictor

ALONE = Config(team=TeamConfig(robots=1))

FIRST_CALLS = """
from quadriga.agents.agent import Agent
from quadriga.agents.controller import controller
from quadriga.agents.plain_ticks import PlainTicks, _plain_tick
from quadriga.agents.rehearsal import rehearse
from quadriga.shared.config.sections import Config, TeamConfig
from quadriga.sim_server.world import motors
from quadriga.sim_server.world.world import World
config = Config(team=TeamConfig(robots=1))
WHAT
first = controller.control_rows, _plain_tick, motors._drive
print(*(len(each.signatures) for each in first))
"""


def test_limits_of_both_qps_are_met(monkeypatch: pytest.MonkeyPatch) -> None:
    """Their first solve would otherwise load code in mid-walk: 40 ms."""
    found = count_calls(monkeypatch, Planner, "step")
    state = rehearse(ALONE, Agent(ALONE, "r1", simple_predictor(ALONE)))
    assert state.mode.name == WALK
    assert state.counters["qp_constrained"] > 0
    assert max(result.iterations for _, result in found) > 0


@pytest.mark.parametrize(
    ("what", "compiled"),
    [
        ('agent = Agent(config, "r1", None)\nrehearse(config, agent)\nPlainTicks(agent)', "1 1 0"),
        ("World(config)", "0 0 1"),
    ],
    ids=["agent", "world"],
)
def test_nothing_of_the_first_tick_is_left_to_compile(what: str, compiled: str) -> None:
    """On a machine that has compiled nothing yet it takes seconds, of a walk in real time."""
    done = subprocess.run(
        [sys.executable, "-c", FIRST_CALLS.replace("WHAT", what)],
        capture_output=True,
        text=True,
        timeout=300.0,
        check=True,
        cwd=Path(__file__).parents[2],
    )
    assert done.stdout == f"{compiled}\n"
