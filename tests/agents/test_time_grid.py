"""The planner's time grid: which phase of the gait a planning step lies in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.agents.gait import (
    gait_phase,
    horizon_stance,
    phase_of,
    scheduled_stance,
    walking_steps,
)
from quadriga.shared.config.sections import Config


def test_ten_planning_steps_of_a_gait_of_400_ms_have_ten_phases() -> None:
    """Stand until 300 ms; the first step is at 320 ms, 20 ms into the gait."""
    config = Config()
    phases = [phase_of(config, step, 10) for step in walking_steps(config)]
    assert phases == list(range(10))
    assert [phase_of(config, step, 2) for step in walking_steps(config)] == [0] * 5 + [1] * 5
    assert {phase_of(config, step, 1) for step in range(40)} == {0}


@settings(deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 40))
def test_a_phase_returns_with_the_gait(tick: int, phases: int) -> None:
    found = gait_phase(tick, 300, 200, phases)
    assert 0 <= found < phases
    assert gait_phase(tick + 400, 300, 200, phases) == found
    assert gait_phase(tick + 200, 300, 200, 2) == 1 - gait_phase(tick, 300, 200, 2)


@settings(deadline=None)
@given(st.integers(300, 5000), st.integers(0, 1))
def test_two_phases_are_the_two_diagonal_pairs(tick: int, robot: int) -> None:
    stance = scheduled_stance(Config(), robot, np.array([tick]))[0]
    assert stance[0] == (gait_phase(tick, 300, 200, 2) == robot)  # every second robot is opposite


@pytest.mark.parametrize("stance_ms", [150, 200, 250])
def test_equal_phases_have_equal_stance_patterns_once_as_fine_as_the_steps(stance_ms: int) -> None:
    config = Config()
    config = replace(config, gait=replace(config.gait, stance_ms=stance_ms))
    finest = 2 * stance_ms // 10
    patterns: dict[int, set[bytes]] = {}
    for step in walking_steps(config):
        pattern = horizon_stance(config, 0, step).tobytes()
        patterns.setdefault(phase_of(config, step, finest), set()).add(pattern)
    assert all(len(found) == 1 for found in patterns.values())
