"""When robots got up, and when they did not walk: then they send no measurements, or no plans."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

from quadriga.recordings.checks.finding import CheckedMessage, Finding
from quadriga.shared.messages import Status
from quadriga.shared.modes import STANDING_UP, WALK
from quadriga.shared.topics import PLAN

_MOST: Final = 100_000  # doubts that are kept; beyond that there is something else amiss
_WINDOW_MS: Final = 1000  # in which windows and plans fill again, after it


class GettingUp:
    """Of each robot the times in which it got up, or did not walk, by its statuses.

    Who gets up sends neither measurements nor plans, and stiff commands; who does not walk, no
    plans.
    """

    def __init__(self) -> None:
        self._up, self._rest = _Times(), _Times()

    def look(self, item: CheckedMessage) -> None:
        """Take in one message, in the order of the file."""
        if not isinstance(item.message, Status):
            return
        tick, robot, mode = item.message.tick, item.robot, item.message.mode
        self._up.note(robot, tick, holds=mode == STANDING_UP)
        self._rest.note(robot, tick, holds=mode != WALK)

    def covers(self, robot: str, first: int, last: int, *, plan: bool = False) -> bool:
        """Whether a robot was getting up in the ticks from `first` to `last`, or had just done.

        Of a `plan`, also whether it did not walk.
        """
        rested = plan and self._rest.meet(robot, first, last)
        return rested or self._up.meet(robot, first - _WINDOW_MS, last)


class _Times:
    """Of each robot the times in which something held."""

    def __init__(self) -> None:
        self._times: dict[str, list[tuple[int, int]]] = {}
        self._begun: dict[str, int] = {}

    def note(self, robot: str, tick: int, *, holds: bool) -> None:
        if holds:
            self._begun.setdefault(robot, tick)
        elif robot in self._begun:
            self._times.setdefault(robot, []).append((self._begun.pop(robot), tick))

    def meet(self, robot: str, first: int, last: int) -> bool:
        """Whether one of them has a tick from `first` to `last`."""
        times = [*self._times.get(robot, ())]
        if robot in self._begun:
            times.append((self._begun[robot], last))
        return any(begin <= last and first <= end for begin, end in times)


class _Doubt(NamedTuple):
    robot: str
    first: int
    last: int
    plan: bool
    object: Callable[[], None]


class Doubts:
    """What breaks a rule unless its robot was getting up, or at rest, which is known at the end.

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
        plan = key.endswith(f"/{PLAN.name}")

        def objection() -> None:
            self._finding.add_objection(tick, key, got, limit, count)

        if len(self._doubts) < _MOST:
            self._doubts.append(_Doubt(robot, first, tick, plan, objection))
        else:
            objection()

    def resolve(self) -> None:
        """Object to what is left, at the end of the recording."""
        for robot, first, last, plan, objection in self._doubts:
            if not self._getting_up.covers(robot, first, last, plan=plan):
                objection()
        self._doubts.clear()
