"""The plants of a team among each other, in real time: who drives time, when one must end.

The plant of all robots has nobody to ask. Where each robot has a plant of its own, that of the
first robot drives time. Ticks begin by the system clocks, see `plant.pace`, and a plant whose
messages are too old is given up.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Final

from quadriga.plant.protocol import End
from quadriga.shared import codes
from quadriga.shared.codec import decode, envelope
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import MessageError
from quadriga.shared.members import has_lead, plant_name
from quadriga.shared.messages import Clock, Event
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.topics import CLOCK, EVENT, STATE

_LOOKS: Final = 10  # one each sample, until a plant that is not there is given up
_JUMP_MS: Final = 5000  # no plant of a team that still walks is so far ahead


class TeamTime:
    """Of the plant of all robots: it drives time, and nobody else has a part in it.

    Attributes:
        drives: whether this plant drives the team's time and ends the walk.
        alone: whether it is the plant of all robots.
        keys: what to subscribe to.
        end: why this plant must end before its own time is over; None: it need not.
        falls: falls of robots that other plants have, until they are taken out.
    """

    drives, alone = True, True

    def __init__(self) -> None:
        self.keys: frozenset[str] = frozenset()
        self.end: End | None = None
        self.falls: list[Event] = []

    def take(self, key: str, payload: bytes, tick: int) -> None:
        """Take in a packet of one of `keys` at this plant's `tick`."""

    def behind(self, oldest: int) -> frozenset[str]:
        """Plants on which this one depends, and whose newest message is of before tick `oldest`."""
        return frozenset()

    def look(self, present: Collection[str]) -> None:
        """Set `end` if a plant on which this one depends is not among those `present`."""


class LeadTime(TeamTime):
    """Of the first robot's plant: it drives time for the plants of the others."""

    alone = False

    def __init__(self, config: Config, robot: str) -> None:
        super().__init__()
        team, self._event = config.team.name, EVENT.key(config.team.name)
        names = [name for name in robot_names(config.team.robots) if name != robot]
        self._others = {name: STATE.key(team, name) for name in names}
        self._newest = dict.fromkeys(self._others.values(), -1)  # tick
        self.keys = frozenset({*self._newest, self._event})

    def take(self, key: str, payload: bytes, tick: int) -> None:
        head = envelope(payload)
        if key == self._event:
            self._take_event(payload)
        elif head is not None and head[0] <= tick + _JUMP_MS:
            self._newest[key] = max(self._newest[key], head[0])

    def _take_event(self, payload: bytes) -> None:
        try:
            event = decode(payload, Event)
        except MessageError:
            return
        if event.robot not in self._others:
            return
        if event.code == codes.COMMAND_LOST:
            self.end = self.end or End(event.code, event.detail)
        elif event.code in codes.DOWN:
            self.falls.append(event)

    def behind(self, oldest: int) -> frozenset[str]:
        found = (name for name, key in self._others.items() if self._newest[key] < oldest)
        return frozenset(map(plant_name, found))

    def look(self, present: Collection[str]) -> None:
        gone = [plant for plant in map(plant_name, self._others) if plant not in present]
        if gone and self.end is None:
            self.end = plant_gone(gone, "gone")


class FollowerTime(TeamTime):
    """Of any other robot's plant: it follows the clock and leaves with who drives it."""

    drives = alone = False

    def __init__(self, config: Config) -> None:
        super().__init__()
        self._key, self._event = CLOCK.key(config.team.name), EVENT.key(config.team.name)
        self.keys = frozenset({self._key, self._event})
        self._lead = frozenset({plant_name(robot_names(config.team.robots)[0])})
        self._now = -1
        # The last messages of a process may arrive after its token has vanished.
        self._looks_left = _LOOKS

    def take(self, key: str, payload: bytes, tick: int) -> None:
        try:
            if key == self._event:
                event = decode(payload, Event)
                if event.kind == "stop":
                    self.end = self.end or End(event.code, event.detail)
                return
            now = decode(payload, Clock).tick
        except MessageError:
            return
        if self._now < now <= tick + _JUMP_MS:
            self._now = now

    def behind(self, oldest: int) -> frozenset[str]:
        return self._lead if self._now < oldest else frozenset()

    def look(self, present: Collection[str]) -> None:
        if has_lead(present):
            return
        self._looks_left -= 1
        if self.end is None and self._looks_left <= 0:
            self.end = plant_gone(sorted(self._lead), "gone")


def team_time(config: Config, robot: str) -> TeamTime:
    """The part in the team's time of a robot's plant, or with "" of the plant of all robots."""
    if not robot:
        return TeamTime()
    leads = robot == robot_names(config.team.robots)[0]
    return LeadTime(config, robot) if leads else FollowerTime(config)


def plant_gone(plants: Sequence[str], how: str) -> End:
    """The end of a walk because of plants that are not there any more."""
    return End(codes.PLANT_GONE, f"{', '.join(plants)} {how}")
