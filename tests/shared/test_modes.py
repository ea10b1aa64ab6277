"""Modes: the normal course, stops, and what is latched."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared.modes import (
    ESTOP,
    PASSIVE,
    PRECEDENCE,
    REASON_MOST,
    SLOW_DOWN_MS,
    STAND,
    STANDING_UP,
    STOPPING,
    WALK,
    Mode,
    Stop,
    next_mode,
    resolve_stops,
)

STAND_MS = 300
WALKING = Mode(WALK, 1)
LOST, ASKED = Stop(STOPPING, "reference-lost"), Stop(STOPPING, "stopped:ann")
FALLEN, PRESSED = Stop(PASSIVE, "fall"), Stop(ESTOP, "estop:dog")


def test_a_robot_stands_then_walks() -> None:
    mode = Mode(STAND, 0)
    for tick in range(STAND_MS):
        assert next_mode(mode, tick, STAND_MS, stance_ends=True) is mode
        assert mode.speed_factor(tick) == 0.0
    mode = next_mode(mode, STAND_MS, STAND_MS, stance_ends=True)
    assert mode == Mode(WALK, STAND_MS)
    assert mode.speed_factor(10**6) == 1.0
    assert next_mode(mode, 10**6, STAND_MS, stance_ends=True) is mode


def test_a_stop_slows_down_and_stands_at_the_end_of_a_stance() -> None:
    mode = resolve_stops(Mode(WALK, STAND_MS), 1050, [LOST])
    assert mode == Mode(STOPPING, 1050, "reference-lost")
    factors = [mode.speed_factor(1050 + since) for since in range(0, SLOW_DOWN_MS + 200, 50)]
    assert factors[0] == 1.0
    assert factors == sorted(factors, reverse=True)
    assert factors[-1] == 0.0
    early, done = 1050 + SLOW_DOWN_MS - 1, 1050 + SLOW_DOWN_MS
    assert next_mode(mode, early, STAND_MS, stance_ends=True) is mode
    assert next_mode(mode, done, STAND_MS, stance_ends=False) is mode
    stood = next_mode(mode, done, STAND_MS, stance_ends=True)
    assert (stood.name, stood.reason) == (STAND, "reference-lost")
    assert next_mode(stood, 10**6, STAND_MS, stance_ends=True) is stood


@pytest.mark.parametrize(
    ("stops", "after"),
    [
        ([], WALKING),
        ([LOST], Mode(STOPPING, 7, "reference-lost")),
        ([LOST, Stop(STAND, "imu-lost")], Mode(STAND, 7, "imu-lost")),
        ([Stop(STAND, "imu-lost"), ASKED], Mode(STAND, 7, "stopped:ann")),
        ([LOST, FALLEN, Stop(PASSIVE, "qp-failed")], Mode(PASSIVE, 7, "fall")),
        ([LOST, FALLEN, PRESSED], Mode(ESTOP, 7, "estop:dog")),
        ([Stop(ESTOP, 300 * "x")], Mode(ESTOP, 7, REASON_MOST * "x")),
    ],
)
def test_of_the_stops_of_one_tick_the_gravest_counts_and_of_equals_the_first(
    stops: list[Stop], after: Mode
) -> None:
    assert resolve_stops(WALKING, 7, stops) == after


@pytest.mark.parametrize(
    ("mode", "stop", "after"),
    [
        (Mode(STAND, 0), LOST, Mode(STAND, 7, "reference-lost")),  # so it does not begin to walk
        (Mode(STOPPING, 5, "a"), Stop(STAND, "imu-lost"), Mode(STAND, 7, "imu-lost")),
        (Mode(PASSIVE, 5, "fall"), PRESSED, Mode(ESTOP, 7, "estop:dog")),
        *((Mode(n, 5, "a"), LOST, Mode(n, 5, "a")) for n in (STOPPING, STAND, PASSIVE, ESTOP)),
        *(
            (Mode(n, 5, "peer-lost:r2"), ASKED, Mode(n, 5, "stopped:ann"))
            for n in (STAND, STOPPING)
        ),
        (Mode(STANDING_UP, 5, "reset:ann"), ASKED, Mode(STANDING_UP, 5, "reset:ann")),
        (Mode(STAND, 5, "stopped:ann"), LOST, Mode(STAND, 5, "stopped:ann")),
        (Mode(PASSIVE, 5, "fall"), Stop(PASSIVE, "qp"), Mode(PASSIVE, 5, "fall")),
        (Mode(ESTOP, 5, "a"), FALLEN, Mode(ESTOP, 5, "a")),
        (Mode(ESTOP, 5, "a"), PRESSED, Mode(ESTOP, 5, "a")),
    ],
)
def test_the_first_reason_stays_but_what_somebody_asks_for_takes_the_place_of_a_loss(
    mode: Mode, stop: Stop, after: Mode
) -> None:
    assert resolve_stops(mode, 7, [stop]) == after


STOPS = st.builds(Stop, st.sampled_from(PRECEDENCE), st.sampled_from(["a", "peer-lost", "stopped"]))


@given(
    st.lists(
        st.tuples(st.lists(STOPS, max_size=3), st.integers(1, 600), st.booleans()), max_size=30
    )
)
def test_whatever_happens_passive_is_latched_and_no_robot_walks_again_by_itself(
    events: list[tuple[list[Stop], int, bool]],
) -> None:
    rank = {STAND: 0, WALK: 0, STOPPING: 0, PASSIVE: 1, ESTOP: 2}
    mode, tick = Mode(STAND, 0), 0
    for stops, passed, stance_ends in events:
        tick += passed
        before = mode
        mode = resolve_stops(next_mode(mode, tick, STAND_MS, stance_ends), tick, stops)
        assert rank[mode.name] >= rank[before.name]
        assert mode.passive == (rank[mode.name] > 0)
        if before.reason:
            assert mode.reason
            assert mode.name != WALK
        if before.passive:
            assert mode.speed_factor(tick) == 0.0
