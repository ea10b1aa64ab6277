"""What lies on the plane of a world: the one interface of all terrains."""

from __future__ import annotations

from typing import Any, ClassVar, Final, NamedTuple, Protocol

import mujoco
import numpy as np

from quadriga.shared.robot.conventions import Array

FOLLOW_MS: Final = 4  # ms between two calls of `MovingBodies.follow`


class MovingBodies(Protocol):
    """Bodies of a terrain that feet can move, while a world runs."""

    def follow(self, feet: Array) -> None:
        """Change what must change between the integration of a tick and the next.

        Args:
            feet: centres of all feet, shape (f, 3), m, world.
        """


class Stones(NamedTuple):
    """Loose stones as they lay before the walk.

    Attributes:
        poses: centre and attitude wxyz of each, shape (k, 7), m, world.
        halves: half axes of each, shape (k, 3), m.
        colours: RGB of each, 0 … 1, shape (k, 3).
    """

    poses: Array
    halves: Array
    colours: Array


class Relief:
    """A plane: a terrain overrides what it has more than that.

    Ground that never moves has `top`, `height` and `add_to`. Bodies that feet can move have the
    rest; they do not count as height of the ground.

    Attributes:
        loose: whether there are such bodies.
    """

    __slots__ = ()
    loose: ClassVar[bool] = False

    @property
    def top(self) -> float:
        """Height of the highest point, m."""
        return 0.0

    def height(self, x: Array, y: Array) -> Array:
        """Height of the ground at world positions x, y of any equal shape, m."""
        return np.zeros(np.shape(x))

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Add what never moves to a world that has its plane and nothing else yet."""

    def add_bodies(self, spec: mujoco.MjSpec, robots: int, friction: float) -> None:
        """Add the bodies that feet can move, after everything else.

        Args:
            spec: the world under construction.
            robots: how many there are.
            friction: sliding friction of feet on the ground.
        """

    def start(
        self, model: Any, physics: Any, robots: int, foot_radius: float
    ) -> MovingBodies | None:
        """Take over the bodies that `add_bodies` has added to a compiled world; None: none.

        Args:
            model: the compiled world.
            physics: its state.
            robots: how many there are.
            foot_radius: radius of their feet, m.
        """
        return None

    def stones_near(self, centre: Array, most: int, reach: float = np.inf) -> Stones:
        """The loose stones around a place, the nearest first.

        Args:
            centre: of the place, shape (2,), m, world.
            most: how many at most.
            reach: how far from there, m.
        """
        return Stones(np.zeros((0, 7)), np.zeros((0, 3)), np.zeros((0, 3)))
