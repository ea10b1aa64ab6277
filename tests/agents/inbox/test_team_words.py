"""What the others say of themselves, and the plant of them, between bus and agent."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.shared.codec import encode
from quadriga.shared.codes import BACK, FALL, GONE, LOWERED, PUSH
from quadriga.shared.messages import Event, Status
from tests.a1 import standing
from tests.agents.inbox.test_inbox import NOTHING, arrivals, feed


def status(tick: int, mode: str) -> Status:
    return Status(tick, 0, mode, "", "", {}, {}, np.zeros(0), np.zeros(0))


def test_in_real_time_the_others_words_are_handed_over_as_they_come() -> None:
    box = arrivals("realtime", planner="none")
    feed(box, ("r3/status", status(100, "walk")), ("r1/status", status(103, "stand")))
    inputs = box.pop_inputs(standing(104), NOTHING)
    assert [(name, said.mode) for name, said in inputs.statuses] == [
        ("r1", "stand"),
        ("r3", "walk"),
    ]
    assert not inputs.bare
    assert box.pop_inputs(standing(105), NOTHING).bare


@pytest.mark.parametrize("mode", ["lockstep", "realtime"])
def test_what_the_plant_says_of_robots_is_handed_over_at_once_in_its_order(mode: str) -> None:
    box = arrivals(mode, planner="none")
    told = [
        Event.of(100, GONE, "r1", "gone"),
        Event.of(102, LOWERED, "r1", "led down"),
        Event.of(104, BACK, "r1", "answers again"),
    ]
    others = [Event.of(101, PUSH, "r1", ""), Event.of(103, FALL, "r1", "")]
    for event in (told[0], others[0], told[1], others[1], told[2]):
        box.take("team/sim/event", encode(event))
    inputs = box.pop_inputs(standing(105), NOTHING)
    assert [event.code for event in inputs.events] == [GONE, LOWERED, BACK]
    assert not inputs.bare
    assert box.pop_inputs(standing(106), NOTHING).bare
