"""Modes: the normal course, safe stops, and what is latched."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.agents.modes import (
    DAMPING,
    ESTOP,
    RISING,
    SLOW_DOWN_MS,
    STAND,
    STOPPING,
    WALK,
    Mode,
    Stop,
    enter_passive,
    resolve_stops,
    step_mode,
    stop_safely,
)

STAND_MS = 300


def test_a_robot_stands_then_walks() -> None:
    mode = Mode(STAND, 0)
    for tick in range(STAND_MS):
        mode = step_mode(mode, tick, STAND_MS, half_cycle_ends=True)
        assert mode == Mode(STAND, 0)
        assert mode.speed_factor(tick) == 0.0
    mode = step_mode(mode, STAND_MS, STAND_MS, half_cycle_ends=True)
    assert mode == Mode(WALK, STAND_MS)
    assert mode.speed_factor(10**6) == 1.0
    assert step_mode(mode, 10**6, STAND_MS, half_cycle_ends=True) is mode


def test_a_safe_stop_slows_down_and_stands_at_the_end_of_a_stance_for_good() -> None:
    mode = stop_safely(Mode(WALK, STAND_MS), 1050, "reference-lost")
    assert mode == Mode(STOPPING, 1050, "reference-lost")
    factors = [mode.speed_factor(1050 + since) for since in range(0, SLOW_DOWN_MS + 200, 50)]
    assert factors[0] == 1.0
    assert factors == sorted(factors, reverse=True)
    assert factors[-1] == 0.0
    early, done = 1050 + SLOW_DOWN_MS - 1, 1050 + SLOW_DOWN_MS
    assert step_mode(mode, early, STAND_MS, half_cycle_ends=True) is mode
    assert step_mode(mode, done, STAND_MS, half_cycle_ends=False) is mode
    stood = step_mode(mode, done, STAND_MS, half_cycle_ends=True)
    assert (stood.name, stood.reason) == (STAND, "reference-lost")
    assert step_mode(stood, 10**6, STAND_MS, half_cycle_ends=True) is stood


def test_a_stop_before_walking_keeps_the_robot_standing() -> None:
    mode = stop_safely(Mode(STAND, 0), 100, "peer-lost:r2")
    assert mode == Mode(STAND, 100, "peer-lost:r2")
    assert step_mode(mode, STAND_MS, STAND_MS, half_cycle_ends=True) is mode


@pytest.mark.parametrize(
    "mode",
    [Mode(STOPPING, 5, "a"), Mode(STAND, 5, "a"), Mode(DAMPING, 5, "a"), Mode(ESTOP, 5, "a")],
)
def test_a_later_reason_to_stop_does_not_replace_the_first(mode: Mode) -> None:
    assert stop_safely(mode, 10, "b") is mode


@pytest.mark.parametrize("name", [STAND, STOPPING, RISING])
def test_what_somebody_asks_for_takes_the_place_of_a_loss_and_no_loss_of_it(name: str) -> None:
    lost, asked = Mode(name, 5, "peer-lost:r2"), Mode(name, 5, "stopped:ann")
    assert stop_safely(lost, 10, "stopped:ann") == asked
    assert stop_safely(lost, 10, "reference-lost") is lost
    assert stop_safely(asked, 10, "peer-lost:r2") is asked
    assert stop_safely(asked, 10, "stopped:bob") is asked


@pytest.mark.parametrize("mode", [Mode(STAND, 0), Mode(WALK, 1), Mode(STOPPING, 2, "a")])
@pytest.mark.parametrize("name", [DAMPING, ESTOP])
def test_any_mode_can_enter_passive(mode: Mode, name: str) -> None:
    passive = enter_passive(mode, 7, name, "why")
    assert passive == Mode(name, 7, "why")
    assert passive.passive
    assert not mode.passive
    assert passive.speed_factor(7) == 0.0


def test_an_emergency_stop_outranks_a_fault_and_the_first_of_each_stays() -> None:
    fault = enter_passive(Mode(WALK, 0), 1, DAMPING, "fall")
    assert enter_passive(fault, 2, DAMPING, "qp") is fault
    stopped = enter_passive(fault, 3, ESTOP, "operator")
    assert stopped == Mode(ESTOP, 3, "operator")
    assert enter_passive(stopped, 4, DAMPING, "fall") is stopped
    assert enter_passive(stopped, 5, ESTOP, "another") is stopped


EVENTS = st.lists(
    st.tuples(
        st.sampled_from(["step", "stop", DAMPING, ESTOP]), st.integers(0, 600), st.booleans()
    ),
    max_size=30,
)


@given(EVENTS)
def test_whatever_happens_passive_is_for_good_and_ranks_only_rise(
    events: list[tuple[str, int, bool]],
) -> None:
    rank = {STAND: 0, WALK: 0, STOPPING: 0, DAMPING: 1, ESTOP: 2}
    mode, tick = Mode(STAND, 0), 0
    for kind, passed, boundary in events:
        tick += passed
        before = mode
        if kind == "step":
            mode = step_mode(mode, tick, STAND_MS, boundary)
        elif kind == "stop":
            mode = stop_safely(mode, tick, "why")
        else:
            mode = enter_passive(mode, tick, kind, kind)
        assert rank[mode.name] >= rank[before.name]
        if before.reason and rank[mode.name] == rank[before.name]:
            assert mode.reason == before.reason
            assert mode.name != WALK


CAUSES = st.lists(
    st.builds(Stop, st.sampled_from([STOPPING, DAMPING, ESTOP]), st.sampled_from(["a", "b", "c"])),
    max_size=5,
)
MODES = st.builds(
    Mode, st.sampled_from([STAND, WALK, STOPPING, DAMPING, ESTOP]), st.just(3), st.just("before")
) | st.sampled_from([Mode(STAND, 3), Mode(WALK, 3)])


@given(MODES, CAUSES)
def test_stops_of_one_tick_come_to_the_same_as_one_after_the_other(
    mode: Mode, stops: list[Stop]
) -> None:
    one_by_one = mode
    for stop in stops:
        if stop.mode == STOPPING:
            one_by_one = stop_safely(one_by_one, 7, stop.reason)
        else:
            one_by_one = enter_passive(one_by_one, 7, stop.mode, stop.reason)
    assert resolve_stops(mode, 7, stops) == one_by_one


def test_of_the_stops_of_one_tick_the_gravest_counts_and_of_equals_the_first() -> None:
    lost, fall = Stop(STOPPING, "reference-lost"), Stop(DAMPING, "fall")
    qp, estop = Stop(DAMPING, "qp-failed"), Stop(ESTOP, "estop:operator")
    walking = Mode(WALK, 1)
    assert resolve_stops(walking, 7, []) is walking
    assert resolve_stops(walking, 7, [lost]) == Mode(STOPPING, 7, "reference-lost")
    assert resolve_stops(walking, 7, [lost, fall, qp]) == Mode(DAMPING, 7, "fall")
    assert resolve_stops(walking, 7, [lost, fall, estop]) == Mode(ESTOP, 7, "estop:operator")
