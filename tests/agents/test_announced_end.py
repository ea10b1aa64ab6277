"""An announced end is believed until time goes on, whatever tick it was announced for."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from quadriga.agents.announced_end import AnnouncedEnd
from quadriga.agents.planning.references import AHEAD_MS


def test_nothing_is_awaited_before_an_end_is_announced() -> None:
    end = AnnouncedEnd()
    assert not end.awaited
    end.pass_tick(5)
    assert not end.awaited


@given(tick=st.integers(0, 2**62), newest=st.integers(-1, 2**40))
def test_it_is_awaited_for_a_second_at_most(tick: int, newest: int) -> None:
    end = AnnouncedEnd()
    end.announce(tick, newest)
    latest = min(tick, max(newest, 0) + AHEAD_MS)
    end.pass_tick(latest)
    assert end.awaited
    end.pass_tick(latest + 1)
    assert not end.awaited


def test_the_last_one_counts() -> None:
    end = AnnouncedEnd()
    end.announce(10, 5)
    end.announce(20, 5)
    end.pass_tick(15)
    assert end.awaited
