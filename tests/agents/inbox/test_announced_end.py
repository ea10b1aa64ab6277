"""Whoever reaches the bus may announce the end of the walk: an agent forgets what does not come."""

from __future__ import annotations

import pytest

from quadriga.shared.messages import Event
from tests.a1 import standing
from tests.agents.inbox.test_inbox import arrivals, feed


@pytest.mark.parametrize("announced", [3, 7, 2**41])
def test_an_announced_end_is_forgotten_once_time_goes_on(announced: int) -> None:
    """A stranger may announce one, of any time: afterwards a pause of the team is no end."""
    box = arrivals()
    feed(box, ("r2/state", standing(5)), ("sim/event", Event(announced, 7, "stop", "", "", "end")))
    assert box.ended
    box.pop_state()
    for tick in range(6, 1100):
        feed(box, ("r2/state", standing(tick)))
        box.pop_state()
    assert not box.ended
