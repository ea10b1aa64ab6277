"""By when the world had reached a tick."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared.errors import ProcessError
from quadriga.stop_times.tick_times import TickTimes

messages = st.lists(st.tuples(st.integers(0, 200), st.integers(0, 10_000)), min_size=1)


@given(messages, st.integers(0, 250))
def test_it_is_when_that_tick_or_a_later_one_was_first_heard_of(
    heard: list[tuple[int, int]], tick: int
) -> None:
    times = TickTimes(f"{number} {at}\n" for number, at in heard)
    later = [at for number, at in heard if number >= tick]
    assert times.latest(tick) == min(later, default=None)


def test_without_a_clock_there_are_none() -> None:
    with pytest.raises(ProcessError, match="the team's clock: got no message"):
        TickTimes([])
