"""When robots got up: meanwhile they send no measurements and plans, and stiff commands."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

from quadriga.agents.modes import RISING
from quadriga.recordings.checks.finding import CheckedMessage, Finding
from quadriga.shared.wire.messages import Status

_MOST: Final = 100_000  # doubts that are kept; beyond that there is something else amiss
_WINDOW_MS: Final = 1000  # in which windows and plans fill again, after it


class GettingUp:
    """Of each robot the times from the begin of its getting up until it stood, by its statuses."""

    def __init__(self) -> None:
        self._times: dict[str, list[tuple[int, int]]] = {}
        self._begun: dict[str, int] = {}

    def look(self, item: CheckedMessage) -> None:
        """Take in one message, in the order of the file."""
        if not isinstance(item.message, Status):
            return
        tick, robot = item.message.tick, item.robot
        if item.message.mode == RISING:
            self._begun.setdefault(robot, tick)
        elif robot in self._begun:
            self._times.setdefault(robot, []).append((self._begun.pop(robot), tick))

    def covers(self, robot: str, first: int, last: int) -> bool:
        """Whether a robot was getting up in the ticks from `first` to `last`, or had just done."""
        times = [*self._times.get(robot, ())]
        if robot in self._begun:
            times.append((self._begun[robot], last))
        return any(begin <= last and first <= end + _WINDOW_MS for begin, end in times)


class _Doubt(NamedTuple):
    robot: str
    first: int
    last: int
    object: Callable[[], None]


class Doubts:
    """What breaks a rule unless its robot was getting up, which is known at the end.

    Args:
        finding: of the rule.
        getting_up: when the robots were.
    """

    def __init__(self, finding: Finding, getting_up: GettingUp) -> None:
        self._finding, self._getting_up = finding, getting_up
        self._doubts: list[_Doubt] = []

    def add(
        self, robot: str, first: int, tick: int, key: str, got: str, limit: str, count: int = 1
    ) -> None:
        """Count something at `tick` that breaks the rule, unless it covers ticks from `first`."""

        def objection() -> None:
            self._finding.add_objection(tick, key, got, limit, count)

        if len(self._doubts) < _MOST:
            self._doubts.append(_Doubt(robot, first, tick, objection))
        else:
            objection()

    def resolve(self) -> None:
        """Object to what is left, at the end of the recording."""
        for robot, first, last, objection in self._doubts:
            if not self._getting_up.covers(robot, first, last):
                objection()
        self._doubts.clear()
