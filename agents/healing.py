"""When a robot that stands because it lacked an input, was led down or stopped, may walk again.

It goes on at the begin of a half cycle, once all its inputs have been whole for
`team.resume_after`, if the operator has said so lately; after a loss also by itself, if the team is
configured so. The time is counted from the begin of a half cycle, so that robots go on together
which find their inputs whole a little apart. From then on they follow the commanded speed in a
ramp. Falls, faults and emergency stops last until the operator releases them; then a robot gets up
and stands.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from quadriga.agents.modes import COMMANDED, LOSSES, RISING, STAND, WALK, Mode, rests
from quadriga.shared.codes import HALTS, INPUT_LOST, RESUMED, RISES, STANDS_AGAIN, code_of
from quadriga.shared.messages import Event, Reference
from quadriga.shared.runtime.record import record

WORD_MS: Final = 5000  # for which the operator's word is obeyed
RAMP_MS: Final = 1000  # from standing to the commanded speed
_LOOKED_BACK_MS: Final = 4000  # at most, from a tick to the oldest reference that still matters


@record
class Healing:
    """What an agent remembers of its way back from a loss.

    Attributes:
        whole_since: tick from which on it counts that its inputs are whole; −1: they are not.
        word: tick of the operator's word to go on; −1: there is none.
        resumed: tick at which the robot has begun to walk again; −1: never.
        stopped: tick at which somebody last said that the team is to stop; −1: nobody has.
    """

    whole_since: int = -1
    word: int = -1
    resumed: int = -1
    stopped: int = -1


def step_healing(
    healing: Healing,
    mode: Mode,
    tick: int,
    *,
    whole_from: int | None,
    word: int = -1,
    stop: int = -1,
) -> Healing:
    """What is remembered after a tick.

    Words are said several times, and may come late: one to go on that was said before a stop, or
    at the same tick, counts no more.

    Args:
        healing: before it.
        mode: after it.
        tick: the present one.
        whole_from: if all inputs are there, the begin of the next half cycle; else None.
        word: tick at which the operator's word to go on was said that has come; −1: none has.
        stop: likewise of a word to stop.
    """
    stopped = max(stop, healing.stopped)
    if not rests(mode):
        idle = healing.whole_since < 0 and healing.word < 0 and stopped == healing.stopped
        return healing if idle else Healing(resumed=healing.resumed, stopped=stopped)
    since = -1
    if whole_from is not None:
        since = healing.whole_since if healing.whole_since >= 0 else whole_from
    heeded = -1 if stop >= 0 else healing.word
    if word > stopped:
        heeded = tick
    return replace(healing, whole_since=since, word=heeded, stopped=stopped)


def may_resume(healing: Healing, mode: Mode, tick: int, *, auto: bool, whole_ms: int) -> bool:
    """Whether a robot may walk again.

    Args:
        healing: what it remembers.
        mode: its mode.
        tick: the present one.
        auto: whether it goes on after a loss without the operator's word.
        whole_ms: for how long its inputs must have been whole, ms.
    """
    if mode.name != STAND or not rests(mode) or healing.whole_since < 0:
        return False
    told = healing.word >= 0 and tick - healing.word <= WORD_MS
    by_itself = auto and code_of(mode.reason) in LOSSES
    return (by_itself or told) and tick - healing.whole_since >= whole_ms


def ramp(references: tuple[Reference, ...], healing: Healing, tick: int) -> tuple[Reference, ...]:
    """The operator's references as a robot follows them that has begun to walk again.

    Nothing is asked of it for the time before, and then a rising share of the speed.
    """
    begun = healing.resumed
    if begun < 0 or tick - begun > RAMP_MS + _LOOKED_BACK_MS:
        return references
    return tuple(_share(item, min(1.0, max(0, item.tick - begun) / RAMP_MS)) for item in references)


def _share(item: Reference, share: float) -> Reference:
    if share == 1.0:
        return item
    return replace(item, vx=share * item.vx, vy=share * item.vy, wz=share * item.wz)


def change_event(before: Mode, after: Mode, tick: int, robot: str) -> Event | None:
    """What an agent announces of a change of its mode: why it stops, and its way back."""
    if after.name == RISING and before.name != RISING:
        return Event.of(tick, RISES, robot, f"gets up where it is: {after.reason}")
    if before.name == RISING and after.name == STAND:
        return Event.of(tick, STANDS_AGAIN, robot, f"stands after {tick - before.since} ms")
    if rests(after) and not before.reason:
        code = HALTS if code_of(after.reason) in COMMANDED else INPUT_LOST
        return Event.of(tick, code, robot, f"slows down and stands: {after.reason}")
    if after.name == WALK and rests(before):
        return Event.of(tick, RESUMED, robot, f"walks again after {before.reason}")
    return None
