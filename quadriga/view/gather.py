"""Folds what a team sends into what a picture of it needs."""

from __future__ import annotations

from typing import Final

from quadriga.shared.messages import Measurement, Message, Plan, Reference, State, Status, Truth
from quadriga.view.placement import Placement
from quadriga.view.snapshot import Snapshot
from quadriga.view.team_shape import TeamShape

_BACK_MS: Final = 2000  # world time that goes back by more is another walk's


class Gatherer:
    """The newest of all that was taken in.

    Messages that are older than what is known are left out, so their order does not matter.
    """

    def __init__(self, shape: TeamShape) -> None:
        """Begin with nothing."""
        self._shape = shape
        self._forget()

    def _forget(self) -> None:
        self._tick = 0
        self._truth: Truth | None = None
        self._reference: Reference | None = None
        self._states: dict[str, State] = {}
        self._measurements: dict[str, Measurement] = {}
        self._plans: dict[str, Plan] = {}
        self._statuses: dict[str, Status] = {}
        self._places: dict[str, Placement] = {}

    def take(self, message: Message, robot: str = "") -> None:
        """Take in a message, of a robot if each sends its own; those of strangers are left out."""
        if isinstance(message, State | Truth):
            if message.tick < self._tick - _BACK_MS:
                self._forget()
            self._tick = max(self._tick, message.tick)
        if isinstance(message, Truth):
            self._take_truth(message)
        elif isinstance(message, Reference):
            if _is_newer(message, self._reference):
                self._reference = message
        elif robot in self._shape.robots:
            self._take_of_robot(message, robot)

    def _take_truth(self, truth: Truth) -> None:
        fits = truth.robots == self._shape.robots and len(truth.base_pos) == self._shape.count
        if fits and _is_newer(truth, self._truth):
            self._truth = truth

    def _take_of_robot(self, message: Message, robot: str) -> None:
        if isinstance(message, State):
            if _is_newer(message, self._states.get(robot)):
                self._states[robot] = message
        elif isinstance(message, Measurement):
            if _is_newer(message, self._measurements.get(robot)):
                self._measurements[robot] = message
                self._places[robot] = self._place(robot, message)
        elif isinstance(message, Plan):
            before = self._plans.get(robot)
            if before is None or message.serial >= before.serial:
                self._plans[robot] = message
        elif isinstance(message, Status) and _is_newer(message, self._statuses.get(robot)):
            self._statuses[robot] = message

    def _place(self, robot: str, measurement: Measurement) -> Placement:
        place = self._places.get(robot)
        if place is None:
            return begin_placement(self._shape, robot, measurement.tick)
        return place.follow(measurement)

    @property
    def tick(self) -> int:
        """World time of the newest state or truth, ms."""
        return self._tick

    @property
    def has_truth(self) -> bool:
        """Whether a simulator says where robots are."""
        return self._truth is not None

    def snapshot(self) -> Snapshot:
        """All that is known now."""
        return Snapshot(
            tick=self._tick,
            truth=self._truth,
            reference=self._reference,
            states=dict(self._states),
            measurements=dict(self._measurements),
            plans=dict(self._plans),
            statuses=dict(self._statuses),
            places=dict(self._places),
        )


def begin_placement(shape: TeamShape, robot: str, tick: int) -> Placement:
    """Where a robot is taken to be when it is heard first: at its place of the formation."""
    x, y = shape.spawn[shape.robots.index(robot), :2].tolist()
    return Placement(tick, x, y, 0.0)


def _is_newer(message: Message, before: Message | None) -> bool:
    return before is None or message.tick >= before.tick
