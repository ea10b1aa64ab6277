"""What the ticks of one key tell: since when it is there, and which messages are missing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from quadriga.shared.config.sections import CENTRAL, Config
from quadriga.shared.wire.topics import (
    COMMAND,
    MEASUREMENT,
    PLAN,
    REFERENCE,
    SAMPLE_MS,
    STATE,
    STATUS,
    TABLE,
    TRUTH,
)

_JUMP: Final = 600_000  # ms: a longer jump is another clock or a forged tick, not a loss
_LONG: Final = 10_000  # ms: so long a jump, or one back, is believed if the next message follows it
_KEPT: Final = 1000  # gaps that are remembered one by one

Gap = tuple[int, int]  # last tick before it, first tick after it


def periods(config: Config) -> dict[str, int]:
    """World time between two messages of a topic by its name, ms; 0: sent on event.

    In real time an agent that was late says its status later.
    """
    lockstep = config.world.mode == "lockstep"
    found = dict.fromkeys((topic.name for topic in TABLE), 0)
    return found | {
        STATE.name: 1,
        COMMAND.name: 1,
        MEASUREMENT.name: SAMPLE_MS,
        PLAN.name: SAMPLE_MS * config.planner.applied,
        STATUS.name: round(1000 / STATUS.rate_hz) if lockstep else 0,
        REFERENCE.name: round(1000 / REFERENCE.rate_hz),
        TRUTH.name: 1 if config.estimator.kind == "truth" else SAMPLE_MS,
    }


def max_ages(config: Config) -> dict[str, int]:
    """Longest gap, and greatest age in use, that is nothing unusual, by topic, ms; 0: none.

    A plan is used until who made it is given up. Those of peers are of the step before; those of
    a central planner come its latency after their data.
    """
    planner = config.planner
    late = max(1, planner.latency_ms) if planner.kind in CENTRAL else 0
    steps = 1 + planner.max_peer_age + planner.hold_steps
    found = {topic.name: topic.max_age_ms for topic in TABLE}
    return found | {PLAN.name: steps * SAMPLE_MS * planner.applied + late}


class TickTrack:
    """The ticks of one key, followed message by message.

    Attributes:
        count: messages.
        first, last: ticks of the first and the newest message, −1 before them; one out of order,
            or far ahead, counts as the newest once the next message goes on from it.
        lost: messages that are missing between them, by the topic's period.
        gaps: where, at most the first thousand.
    """

    __slots__ = ("_odd", "_period", "count", "first", "gaps", "last", "lost")

    def __init__(self, period: int, before: int = -1) -> None:
        """Begin to follow.

        Args:
            period: world time between two messages, ms; 0: none is missed.
            before: tick of the message before the first one here, −1 if unknown.
        """
        self._period, self.last = period, before
        self._odd = -1  # tick that no other has borne out yet
        self.first = -1
        self.count = self.lost = 0
        self.gaps: list[Gap] = []

    def note(self, tick: int) -> None:
        """A message has come; a negative tick stands for one that could not be read."""
        self.count += 1
        if tick < 0:
            return
        if self.first < 0:
            self.first = tick
        if self.last < 0 or self._period == 0 or 0 <= tick - self.last < _LONG:
            self._go_on(tick)
        elif self._odd >= 0 and 0 < tick - self._odd <= self._period:
            self._go_on(self._odd)
            self._go_on(tick)
        else:
            self._odd = tick

    def _go_on(self, tick: int) -> None:
        step = tick - self.last
        if step > self._period > 0 <= self.last and step < _JUMP:
            missing = (step - 1) // self._period
            self.lost += missing
            if missing and len(self.gaps) < _KEPT:
                self.gaps.append((self.last, tick))
        self.last, self._odd = tick, -1


def lost_by_key(tracks: Mapping[str, TickTrack]) -> dict[str, int]:
    """Missing messages of the keys that miss some."""
    return {key: track.lost for key, track in sorted(tracks.items()) if track.lost}
