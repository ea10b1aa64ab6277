"""An IMU that is late is found out by the legs; feet that slide do not make one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from quadriga.agents.controller.memory import MEMORY, initial_memory
from quadriga.agents.imu_delay import DELAY, find_delay, nothing_said
from quadriga.shared.robot.conventions import Array
from quadriga.shared.wire.messages import State
from tests.a1 import GEOMETRY, leg_kinematics, standing
from tests.agents.still_feet import rates_over_still_feet

END = 1000  # ms
HALF_CYCLE = 200  # ms
PAIRS = (0, 3), (1, 2)


def turning(tick: float) -> Array:
    """How a trunk turns that is shaken, (3,), rad/s."""
    t = 1e-3 * tick
    return np.array([1.2 * np.sin(31.0 * t), 1.5 * np.cos(27.0 * t), 0.3 * np.sin(11.0 * t)])


Turn = Callable[[int], Array]


def trotting(tick: int, said: Turn, slip: float = 0.0, turn: Turn = turning) -> State:
    """A shaken trunk over feet of which two stand, and a gyro that says this."""
    chance = np.random.default_rng(tick)
    state = standing(tick)
    velocity = np.array([0.5, 0.0, 0.05 * np.sin(0.02 * tick)])
    rates = rates_over_still_feet(state.q_joint, velocity, turn(tick))
    rates += 0.05 * chance.standard_normal(12)
    rates[3:6] += slip * np.sin(0.013 * tick)
    return replace(state, v_joint=rates, imu_gyro=said(tick) + 0.01 * chance.standard_normal(3))


def feet_at(tick: int) -> Array:
    flat = initial_memory()
    flat[MEMORY.contact] = 0.0
    flat[MEMORY.contact][list(PAIRS[tick // HALF_CYCLE % 2])] = 1.0
    return flat


def found(said: Turn, slip: float = 0.0, end: int = END, turn: Turn = turning) -> list[bool]:
    """Whether the IMU was late, by tick."""
    row, late = nothing_said(), list[bool]()
    for tick in range(end):
        state = trotting(tick, said, slip, turn)
        late.append(find_delay(row, state.row, feet_at(tick), tick, 1, GEOMETRY))
    return late


@pytest.mark.parametrize("slip", [0.0, 8.0])
def test_an_imu_in_time_is_not_late_on_feet_that_stand_or_slide(slip: float) -> None:
    assert not any(found(turning, slip))


@pytest.mark.parametrize("lag", [35, 50, 90])
def test_a_late_imu_is_found_within_a_fifth_of_a_second(lag: int) -> None:
    late = found(lambda tick: turning(tick - lag if tick >= 300 else tick))
    assert not any(late[:300])
    assert 300 < late.index(True) <= 500


def test_an_imu_that_says_nothing_or_anything_is_not_late() -> None:
    assert not any(found(lambda _tick: np.zeros(3)))
    chance = np.random.default_rng(0)
    assert not any(found(lambda _tick: chance.uniform(-35.0, 35.0, 3)))


def test_a_trunk_that_hardly_turns_is_in_no_danger() -> None:
    late = found(lambda tick: 0.2 * turning(tick - 50), turn=lambda tick: 0.2 * turning(tick))
    assert not any(late)


def test_an_imu_in_time_again_is_believed_again_and_one_late_again_is_doubted_longer() -> None:
    late = found(lambda tick: turning(tick - 50 if tick < 300 or tick > 1500 else tick), end=2400)
    first = late.index(True)
    last = late.index(False, first)
    assert last - first == 400
    second = late.index(True, last)
    assert second > 1500
    assert all(late[second:])


def test_ticks_passed_over_are_ticks_at_which_legs_said_nothing() -> None:
    row = nothing_said()
    for tick in [*range(0, 300, 2), 900]:
        ticks = 602 if tick == 900 else 2
        state = trotting(tick, turning)
        assert not find_delay(row, state.row, feet_at(tick), tick, ticks, GEOMETRY)
    assert row[DELAY.legs].reshape(-1, 7)[:, -1].sum() == 1.0


def test_without_feet_that_stand_nothing_is_known() -> None:
    row, memory = nothing_said(), np.zeros(len(initial_memory()))
    for tick in range(300):
        state = trotting(tick, lambda t: turning(t - 50))
        assert not find_delay(row, state.row, memory, tick, 1, GEOMETRY)
    assert not row.any()


def test_the_legs_tell_how_the_trunk_turns_but_for_the_line_through_two_feet() -> None:
    state = standing(0)
    place, _, _ = leg_kinematics(state.q_joint, np.zeros(12))
    line = place[1] - place[2]
    omega = np.array([0.3, -1.1, 0.7])
    rates = rates_over_still_feet(state.q_joint, np.array([0.4, -0.1, 0.2]), omega)
    row, state = nothing_said(), replace(state, v_joint=rates)
    find_delay(row, state.row, feet_at(HALF_CYCLE), HALF_CYCLE, 1, GEOMETRY)
    np.testing.assert_allclose(row[DELAY.turn], omega - line * (line @ omega) / (line @ line))
