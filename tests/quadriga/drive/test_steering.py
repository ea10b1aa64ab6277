"""What a driven team is told: to stand when nobody drives, to go on when somebody does."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.drive.charge import InCharge
from quadriga.drive.steering import GO_ON, STOP, LastWord, steer
from quadriga.drive.wish import Wish
from quadriga.shared.messages import Status

AHEAD = Wish(0.4, 0.0, 0.0, 0.26)
DRIVES = InCharge("page 1", 1000, AHEAD, held=True)
NOBODY = InCharge()
OURS = "stopped:driver: nobody drives"


def all_say(mode: str, reason: str = "") -> dict[str, Status]:
    none = np.zeros(0)
    status = Status(5, 0, mode, reason, "kalman", {}, {}, none, none)
    return {"r1": status, "r2": status}


@pytest.mark.parametrize(("mode", "word"), [("walk", STOP), ("stand", STOP), ("estop", "")])
def test_who_walks_or_is_about_to_is_told_to_stand_while_nobody_drives(
    mode: str, word: str
) -> None:
    step = steer(LastWord(), NOBODY, all_say(mode), 1000)
    assert (step.word, step.wish) == (word, None)
    assert step.reason == ("driver: nobody drives" if word else "")


@pytest.mark.parametrize(
    ("mode", "reason", "word"),
    [
        ("stand", OURS, GO_ON),
        ("stopping", OURS, GO_ON),
        ("stand", "stopped:lunch", ""),
        ("stand", "reset:ann", ""),
        ("stand", "peer-lost:r2", ""),
        ("estop", "estop:dog", ""),
    ],
)
def test_who_stands_goes_on_only_if_it_stood_for_want_of_a_driver(
    mode: str, reason: str, word: str
) -> None:
    step = steer(LastWord(), DRIVES, all_say(mode, reason), 1000)
    assert (step.word, step.wish) == (word, None)


def test_speed_is_asked_for_only_once_all_walk() -> None:
    assert steer(LastWord(), DRIVES, all_say("walk"), 1000).wish == AHEAD
    some = {**all_say("walk"), "r2": all_say("stand", OURS)["r2"]}
    assert steer(LastWord(), DRIVES, some, 1000).wish is None
    assert steer(LastWord(), DRIVES, {}, 1000).wish is None


def test_a_word_is_said_again_only_after_a_while_and_another_at_once() -> None:
    said, now = list[tuple[int, str]](), 1000
    last = LastWord()
    for now in range(1000, 1500, 20):
        step = steer(last, NOBODY, all_say("walk"), now)
        last = step.last
        said += [(now, step.word)] if step.word else []
    assert said == [(1000, STOP), (1200, STOP), (1400, STOP)]
    step = steer(last, InCharge(ended="page 1 is silent"), all_say("walk"), now)
    assert (step.word, step.reason) == (STOP, "driver: page 1 is silent")
