"""The plants of a team among each other, in real time: who drives time, when one must end.

The plant of all robots has nobody to ask. Where each robot has a plant of its own, that of the
first robot drives time. Ticks begin by the system clocks, see `plant.loops`, and a plant whose
messages are too old is given up.
"""

from __future__ import annotations

from collections.abc import Collection
from contextlib import suppress
from typing import Final

from quadriga.plant.protocol import End
from quadriga.shared import codes
from quadriga.shared.codec import decode, envelope
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import MessageError
from quadriga.shared.members import plant_name
from quadriga.shared.messages import Event
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.topics import CLOCK, EVENT, TICKS

_LOOKS: Final = 10  # one each sample: the announced end may come after who drives time has left
_JUMP_MS: Final = 5000  # no plant of a team that still walks is so far ahead


class TeamTime:
    """One plant's part in the team's time.

    The first robot's plant hears the batches of ticks of the others and what happens there; any
    other plant hears the clock, and the announced end of the walk.

    Args:
        config: the team's configuration.
        robot: the robot that it is the plant of; "": of all.

    Attributes:
        alone: whether it is the plant of all robots.
        drives: whether this plant drives the team's time and ends the walk.
        keys: what to subscribe to.
        end: why this plant must end before its own time is over; None: it need not.
        falls: falls of robots that other plants have, until they are taken out.
    """

    def __init__(self, config: Config, robot: str = "") -> None:
        team, (first, *others) = config.team.name, robot_names(config.team.robots)
        self.alone, self.drives = not robot, robot in ("", first)
        self._plants: dict[str, str] = {}  # on which this one depends, by the key that is heard
        if robot:
            heard = {TICKS.key(team, plant_name(name)): plant_name(name) for name in others}
            self._plants = heard if self.drives else {CLOCK.key(team): plant_name(first)}
        self._event, self._others = EVENT.key(team), frozenset(others)
        self.keys = frozenset([*self._plants, self._event] if robot else ())
        self.end: End | None = None
        self.falls: list[Event] = []
        self._newest = dict.fromkeys(self._plants, -1)  # tick
        self._timeout = config.bus.clock_timeout  # s
        self._looks_left = 1 if self.drives else _LOOKS  # none walks on without the others

    def take(self, key: str, payload: bytes, tick: int) -> None:
        """Take in a packet of one of `keys` at this plant's `tick`."""
        if key == self._event:
            with suppress(MessageError):
                self._take_event(decode(payload, Event))
            return
        head = envelope(payload)
        if head is not None and head[0] <= tick + _JUMP_MS:
            self._newest[key] = max(self._newest[key], head[0])

    def _take_event(self, event: Event) -> None:
        if not self.drives:
            ends = event.kind == "stop"
        else:
            ours = event.robot in self._others
            ends = ours and event.code == codes.COMMAND_LOST
            self.falls += [event] if ours and event.code in codes.DOWN else []
        if ends:
            self.end = self.end or End(event.code, event.detail)

    def look(self, present: Collection[str], tick: int) -> None:
        """Set `end` if a plant on which this one depends is gone, or silent.

        Args:
            present: processes that are there.
            tick: this plant's.
        """
        gone = {plant for plant in self._plants.values() if plant not in present}
        self._looks_left -= bool(gone)
        if gone and self._looks_left <= 0:
            self._end_without(gone, "gone")
        oldest = tick - round(1000 * self._timeout)
        silent = {plant for key, plant in self._plants.items() if self._newest[key] < oldest}
        self._end_without(silent, f"silent for {self._timeout:g} s")

    def _end_without(self, plants: Collection[str], how: str) -> None:
        if plants and self.end is None:
            self.end = End(codes.PLANT_GONE, f"{', '.join(sorted(plants))} {how}")
