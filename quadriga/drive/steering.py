"""What the operator tells a team that is driven: references, and when to stand and to go on.

A pure function of who is in charge, what the robots say they do, and the time.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple

from quadriga.drive.charge import InCharge, why_stand
from quadriga.drive.wish import Wish
from quadriga.shared.codes import with_detail
from quadriga.shared.messages import Status
from quadriga.shared.modes import STAND, STOPPED, STOPPING, WALK
from quadriga.shared.runtime.record import record

DRIVER: Final = "driver: "  # begins the reason of a stop that driving on ends
_AGAIN_MS: Final = 200  # after which a word is said once more that not all have followed

STOP, GO_ON = "stop", "go-on"


@record
class LastWord:
    """What the operator remembers: the last word, its reason, and when it was said; −1: never."""

    word: str = ""
    reason: str = ""
    said: int = -1


class Steered(NamedTuple):
    """What a step gives.

    Attributes:
        last: what is remembered.
        wish: what the references are to approach; None: that the team stands.
        word: `STOP`, `GO_ON`, or "" if nothing is to be said.
        reason: of a stop.
    """

    last: LastWord
    wish: Wish | None
    word: str = ""
    reason: str = ""


def steer(last: LastWord, charge: InCharge, statuses: Mapping[str, Status], now: int) -> Steered:
    """One step.

    Args:
        last: what is remembered.
        charge: who is in charge, at `now`.
        statuses: the newest of each robot.
        now: ms.
    """
    why = why_stand(charge)
    if why:
        reason = f"{DRIVER}{why}"
        walks = any(status.mode == WALK for status in statuses.values())
        stands_ready = any(
            status.mode == STAND and not status.reason for status in statuses.values()
        )
        return _say(last, None, STOP if walks or stands_ready else "", reason, now)
    waits = any(_stands_for_driver(status) for status in statuses.values())
    all_walk = bool(statuses) and all(status.mode == WALK for status in statuses.values())
    wish = charge.wish if all_walk else None
    return _say(last, wish, GO_ON if waits else "", "", now)


def _stands_for_driver(status: Status) -> bool:
    """Whether a robot slows down or stands because nobody drove it."""
    ours = status.reason.startswith(with_detail(STOPPED, DRIVER))
    return status.mode in (STAND, STOPPING) and ours


def _say(last: LastWord, wish: Wish | None, word: str, reason: str, now: int) -> Steered:
    """The step with this word, unless it has just been said."""
    same = (word, reason) == (last.word, last.reason)
    if not word or (same and now - last.said < _AGAIN_MS):
        return Steered(last, wish)
    return Steered(LastWord(word, reason, now), wish, word, reason)
