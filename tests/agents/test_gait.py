"""The trot's schedule, the phases of the planner's steps in it, and the nominal forces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.agents.gait import (
    STANDING,
    Gait,
    gait_phase,
    horizon_stance,
    phase_of,
    scheduled_stance,
    walking_steps,
)
from quadriga.shared.config.sections import Config, GaitConfig
from quadriga.shared.modes import STAND, WALK, Mode
from quadriga.shared.robots.conventions import GRAVITY, Leg
from tests.a1 import TOTAL_MASS, nominal_forces

GAITS = st.builds(
    GaitConfig,
    stance_ms=st.integers(5, 50).map(lambda x: 10 * x),
    stand_ms=st.integers(10, 80).map(lambda x: 10 * x),
)


def of(gait: GaitConfig, *, alternate: bool = True) -> Config:
    config = Config()
    return replace(config, gait=gait, team=replace(config.team, alternate_phase=alternate))


@given(GAITS, st.integers(0, 9), st.booleans())
@settings(deadline=None, max_examples=40)
def test_diagonal_pairs_stand_in_turn_for_the_stance_time(
    gait: GaitConfig, index: int, alternate: bool
) -> None:
    """Duty one half; every second robot trots half a period later, unless they trot together."""
    ticks, half = np.arange(gait.stand_ms + 4 * gait.stance_ms), gait.stance_ms
    stance = scheduled_stance(of(gait, alternate=alternate), index, ticks)
    assert stance[: gait.stand_ms].all()
    walking = stance[gait.stand_ms :]
    assert (walking.sum(axis=1) == 2).all()
    np.testing.assert_array_equal(walking[:, Leg.FL], walking[:, Leg.RR])
    np.testing.assert_array_equal(walking[:, Leg.FR], walking[:, Leg.RL])
    np.testing.assert_array_equal(walking[half:], ~walking[:-half])
    assert (walking[:half, Leg.FL] == (not alternate or index % 2 == 0)).all()


@given(GAITS, st.integers(0, 1), st.integers(0, 5000))
@settings(deadline=None, max_examples=60)
def test_a_row_of_the_gait_says_the_same_as_the_schedule(
    gait: GaitConfig, index: int, since: int
) -> None:
    config, tick = of(gait), gait.stand_ms + since
    *stance, progress, half_cycle = Gait(config, index).at(tick, Mode(WALK, 0))
    assert progress == (since % gait.stance_ms) / gait.stance_ms
    assert half_cycle == (since // gait.stance_ms + index) % 2
    np.testing.assert_array_equal(stance, scheduled_stance(config, index, np.array([tick]))[0])
    assert Gait(config, index).at(tick, Mode(STAND, 0)) is STANDING


@pytest.mark.parametrize("legs", range(1, 16))
def test_nominal_forces_carry_the_weight_on_the_stance_feet(legs: int) -> None:
    stance = np.array([bool(legs >> leg & 1) for leg in range(4)])
    forces = nominal_forces(stance).reshape(4, 3)
    assert forces[:, 2].sum() == pytest.approx(TOTAL_MASS * GRAVITY, rel=1e-12)
    assert not forces[:, :2].any()
    assert not forces[~stance].any()
    assert np.ptp(forces[stance, 2]) == 0.0
    many = nominal_forces(np.array([stance, np.zeros(4, dtype=bool)]))
    np.testing.assert_array_equal(many, [forces.ravel(), np.zeros(12)])


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
