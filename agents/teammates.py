"""Who else is there: which other robots can walk, by the plant and themselves, and the operator.

A robot does not walk while another one of its team does not: it would drag it along. Whether its
planner takes in anything of the others does not matter.

In real time each robot hears every other's status ten times a second, and at once when its mode
changes. In lock-step it does not: what it knows would depend on who was faster. There, and sooner
than by a silence, it knows from the plant which robots' commands no longer come. In real time the
plant also tells that the operator has left: then its references, which speak of the near future,
count no more.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field
from typing import Final

from quadriga.agents.modes import STAND, STOPPING, WALK, Mode, rests
from quadriga.shared.codes import BACK, GONE, LOWERED, OPERATOR_BACK, OPERATOR_GONE, SILENT
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Event, Reference, Status
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.record import record

SILENCE_MS: Final = 500  # without a status, after which a robot is lost
GRACE_MS: Final = 1000  # for which robots that walk again may begin one after the other
_OF_ROBOTS: Final = frozenset((GONE, SILENT, BACK))
_OF_OPERATOR: Final = frozenset((OPERATOR_GONE, OPERATOR_BACK))
_COMING_TO_REST: Final = (STAND, STOPPING)


@record
class Heard:
    """What a robot's newest status says: of which tick it is, and what the robot does and why."""

    tick: int
    mode: str
    reason: str


@record
class Teammates:
    """What an agent remembers of the other robots.

    Attributes:
        heard: of each that has spoken.
        lost: of those whose commands no longer come, tick at which the plant has said so.
        operator_gone: tick at which the plant has said that the operator is gone; −1: it is not.
        unheeded: whether the plant has said that it does not follow the own commands.
    """

    heard: Mapping[str, Heard] = field(default_factory=dict)
    lost: Mapping[str, int] = field(default_factory=dict)
    operator_gone: int = -1
    unheeded: bool = False


class TeamWatch:
    """Fixed data of how one robot watches the others; its functions depend on their arguments.

    Args:
        config: the team's configuration.
        robot: the one that watches.

    Attributes:
        names: of the others.
    """

    def __init__(self, config: Config, robot: str) -> None:
        self.names = tuple(n for n in robot_names(config.team.robots) if n != robot)
        self._robot, self._hears = robot, config.world.mode == "realtime"

    def remember(
        self, known: Teammates, statuses: Iterable[tuple[str, Status]], events: Iterable[Event]
    ) -> Teammates:
        """What is known with what has arrived; the last of several counts."""
        heard, lost, gone = dict(known.heard), dict(known.lost), known.operator_gone
        unheeded = known.unheeded
        for name, status in statuses:
            heard[name] = Heard(status.tick, status.mode, status.reason)
        for event in events:
            if event.code in _OF_OPERATOR:
                gone = event.tick if event.code == OPERATOR_GONE else -1
            elif event.robot == self._robot:
                unheeded = event.code != BACK
            elif event.code == BACK:
                lost.pop(event.robot, None)
            elif event.robot in self.names and event.code in _OF_ROBOTS:
                lost[event.robot] = event.tick
        return Teammates(heard, lost, gone, unheeded)

    def is_led_down(self, events: Iterable[Event]) -> bool:
        """Whether one of these tells that the plant has led down the robot that watches."""
        return any(e.code == LOWERED and e.robot == self._robot for e in events)

    def find_lost(self, known: Teammates, tick: int, since: int) -> tuple[str, ...]:
        """Robots because of which one may not walk on.

        Whoever has not spoken yet is not missed: an agent need not say how it is.

        Args:
            known: what is known at `tick`.
            tick: the present one.
            since: when the robot that watches began to walk.
        """
        if not (known.lost or known.heard):  # as at every tick of lock-step without a loss
            return ()
        return tuple(
            name
            for name in self.names
            if _is_lost(known, name)
            or (name in known.heard and _has_stopped(known.heard[name], tick, since))
        )

    def are_ready(self, known: Teammates, tick: int) -> bool:
        """Whether all others can walk: they stand and may walk again, or walk already."""
        if any(_is_lost(known, name) for name in self.names):
            return False
        return not self._hears or all(
            name in known.heard and _can_walk(known.heard[name], tick) for name in self.names
        )

    def are_still(self, known: Teammates, tick: int, since: int) -> bool:
        """Whether none walks as far as it is known; after a while nobody is waited for.

        Args:
            known: what is known at `tick`.
            tick: the present one.
            since: from when on they could be heard.
        """
        recent = [h for h in known.heard.values() if tick - h.tick <= SILENCE_MS and h.tick > since]
        if any(h.mode in (WALK, STOPPING) for h in recent):
            return False
        return len(recent) == len(self.names) or tick - since > GRACE_MS


def concerns_agents(event: Event) -> bool:
    """Whether an event of the plant tells that a robot's commands, or the operator, come or not.

    Or that a robot has been led down: its agent may not know that its commands came too late.
    """
    of_robot = event.code in _OF_ROBOTS or event.code == LOWERED
    return event.code in _OF_OPERATOR or (of_robot and bool(event.robot))


def has_operator(known: Teammates, references: Sequence[Reference]) -> bool:
    """Whether the operator is there, as far as an agent knows.

    That it is again might not be heard; then references of long after tell it.

    Args:
        known: what is known.
        references: of the operator, oldest first.
    """
    at = known.operator_gone
    return at < 0 or bool(references and references[-1].tick > at + GRACE_MS)


def _is_lost(known: Teammates, name: str) -> bool:
    """Whether the plant gets no commands of a robot.

    That it does again might not be heard; then the robot's own words long after tell it.
    """
    at, heard = known.lost.get(name), known.heard.get(name)
    return at is not None and (heard is None or heard.tick <= at + GRACE_MS)


def _has_stopped(heard: Heard, tick: int, since: int) -> bool:
    if tick - heard.tick > SILENCE_MS:
        return True
    if heard.mode in _COMING_TO_REST:
        return bool(heard.reason) and heard.tick > since + GRACE_MS
    return heard.mode != WALK


def _can_walk(heard: Heard, tick: int) -> bool:
    if tick - heard.tick > SILENCE_MS:
        return False
    if heard.mode == STAND:
        return not heard.reason or rests(Mode(STAND, heard.tick, heard.reason))
    return heard.mode == WALK
