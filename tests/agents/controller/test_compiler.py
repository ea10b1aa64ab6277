"""The agent without the compiler: the same commands, only later."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np

from quadriga.agents.agent import Agent, Inputs
from quadriga.shared.config.sections import Config, GaitConfig, PlannerConfig, TeamConfig
from quadriga.shared.messages import Reference
from tests.a1 import standing

TICKS = 30
CONFIG = Config(
    team=TeamConfig(robots=1), gait=GaitConfig(stand_ms=20), planner=PlannerConfig(kind="none")
)


def torques() -> bytes:
    """Of a robot that is held in the air while it begins to trot, (TICKS, 12)."""
    agent = Agent(CONFIG, "r1", None)
    state, found = agent.initial(), []
    for tick in range(TICKS):
        reference = Reference(tick, tick * 1_000_000, 0.3, 0.1, 0.2, 0.26)
        state, outputs = agent.step(state, Inputs(standing(tick), references=(reference,)))
        found.append(outputs.command.tau)
    return np.array(found).tobytes()


def test_without_the_compiler_the_torques_are_the_same() -> None:
    script = f"import sys; from {__name__} import torques; sys.stdout.buffer.write(torques())"
    plain = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        check=True,
        capture_output=True,
        cwd=os.getcwd(),
    )
    interpreted = np.frombuffer(plain.stdout).reshape(TICKS, 12)
    compiled = np.frombuffer(torques()).reshape(TICKS, 12)
    assert np.abs(compiled).max() > 1.0
    np.testing.assert_allclose(interpreted, compiled, atol=1e-9)
