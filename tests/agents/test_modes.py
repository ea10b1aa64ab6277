"""Modes: the normal course, safe stops, and what is latched."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.agents.modes import (
    DAMPING,
    ESTOP,
    SLOW_DOWN_MS,
    STAND,
    STOPPING,
    WALK,
    Mode,
    go_limp,
    step_mode,
    stop_safely,
)

STAND_MS = 300


def test_a_robot_stands_then_walks() -> None:
    mode = Mode(STAND, 0)
    for tick in range(STAND_MS):
        mode = step_mode(mode, tick, STAND_MS, half_boundary=True)
        assert mode == Mode(STAND, 0)
        assert mode.speed_factor(tick) == 0.0
    mode = step_mode(mode, STAND_MS, STAND_MS, half_boundary=True)
    assert mode == Mode(WALK, STAND_MS)
    assert mode.speed_factor(10**6) == 1.0
    assert step_mode(mode, 10**6, STAND_MS, half_boundary=True) is mode


def test_a_safe_stop_slows_down_and_stands_at_the_end_of_a_stance_for_good() -> None:
    mode = stop_safely(Mode(WALK, STAND_MS), 1050, "reference-lost")
    assert mode == Mode(STOPPING, 1050, "reference-lost")
    factors = [mode.speed_factor(1050 + since) for since in range(0, SLOW_DOWN_MS + 200, 50)]
    assert factors[0] == 1.0
    assert factors == sorted(factors, reverse=True)
    assert factors[-1] == 0.0
    early, done = 1050 + SLOW_DOWN_MS - 1, 1050 + SLOW_DOWN_MS
    assert step_mode(mode, early, STAND_MS, half_boundary=True) is mode
    assert step_mode(mode, done, STAND_MS, half_boundary=False) is mode
    stood = step_mode(mode, done, STAND_MS, half_boundary=True)
    assert (stood.name, stood.reason) == (STAND, "reference-lost")
    assert step_mode(stood, 10**6, STAND_MS, half_boundary=True) is stood


def test_a_stop_before_walking_keeps_the_robot_standing() -> None:
    mode = stop_safely(Mode(STAND, 0), 100, "peer-lost:r2")
    assert mode == Mode(STAND, 100, "peer-lost:r2")
    assert step_mode(mode, STAND_MS, STAND_MS, half_boundary=True) is mode


@pytest.mark.parametrize(
    "mode",
    [Mode(STOPPING, 5, "a"), Mode(STAND, 5, "a"), Mode(DAMPING, 5, "a"), Mode(ESTOP, 5, "a")],
)
def test_a_later_reason_to_stop_does_not_replace_the_first(mode: Mode) -> None:
    assert stop_safely(mode, 10, "b") is mode


@pytest.mark.parametrize("mode", [Mode(STAND, 0), Mode(WALK, 1), Mode(STOPPING, 2, "a")])
@pytest.mark.parametrize("name", [DAMPING, ESTOP])
def test_any_mode_can_go_limp(mode: Mode, name: str) -> None:
    limp = go_limp(mode, 7, name, "why")
    assert limp == Mode(name, 7, "why")
    assert limp.limp
    assert not mode.limp
    assert limp.speed_factor(7) == 0.0


def test_an_emergency_stop_outranks_a_fault_and_the_first_of_each_stays() -> None:
    fault = go_limp(Mode(WALK, 0), 1, DAMPING, "fall")
    assert go_limp(fault, 2, DAMPING, "qp") is fault
    stopped = go_limp(fault, 3, ESTOP, "operator")
    assert stopped == Mode(ESTOP, 3, "operator")
    assert go_limp(stopped, 4, DAMPING, "fall") is stopped
    assert go_limp(stopped, 5, ESTOP, "another") is stopped


EVENTS = st.lists(
    st.tuples(
        st.sampled_from(["step", "stop", DAMPING, ESTOP]), st.integers(0, 600), st.booleans()
    ),
    max_size=30,
)


@given(EVENTS)
def test_whatever_happens_limp_is_for_good_and_ranks_only_rise(
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
            mode = go_limp(mode, tick, kind, kind)
        assert rank[mode.name] >= rank[before.name]
        if before.reason and rank[mode.name] == rank[before.name]:
            assert mode.reason == before.reason
            assert mode.name != WALK
