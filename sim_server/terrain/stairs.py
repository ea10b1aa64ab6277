"""Stairs across the team's way: up, a landing, and down again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np

from quadriga.shared.config.world import WorldConfig
from quadriga.shared.robot.conventions import Array
from quadriga.sim_server.terrain.contact import TERRAIN_CONTACT
from quadriga.sim_server.terrain.course import Course
from quadriga.sim_server.terrain.relief import Relief

_LANDING: Final = 1.5  # m, between the last riser up and the first one down
_RGBA: Final = ((0.66, 0.66, 0.64, 1.0), (0.58, 0.58, 0.57, 1.0))  # every second step


@dataclass(frozen=True, slots=True)
class Stairs(Relief):
    """Boxes on top of each other, each a tread shorter at both ends: their sides are the risers.

    Attributes:
        risers: where the risers up and down are, shape (count, 2), m along x, world.
        sides: where the stairs end to the right and to the left, m along y, world.
        rise: height of a step, m.
    """

    risers: Array
    sides: tuple[float, float]
    rise: float

    @property
    def top(self) -> float:
        """Height of the landing, m."""
        return len(self.risers) * self.rise

    def height(self, x: Array, y: Array) -> Array:
        """Height of the treads, or zero, at positions of any equal shape, m."""
        beyond = np.asarray(x)[..., None]
        steps = ((beyond >= self.risers[:, 0]) & (beyond <= self.risers[:, 1])).sum(axis=-1)
        beside = (np.asarray(y) < self.sides[0]) | (np.asarray(y) > self.sides[1])
        return np.where(beside, 0.0, self.rise * steps)

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Add one box geom per step to the world body."""
        right, left = self.sides
        for i, (near, far) in enumerate(self.risers.tolist()):
            spec.worldbody.add_geom(
                type=mujoco.mjtGeom.mjGEOM_BOX,
                pos=[(near + far) / 2.0, (right + left) / 2.0, (i + 0.5) * self.rise],
                size=[(far - near) / 2.0, (left - right) / 2.0, self.rise / 2.0],
                rgba=_RGBA[i % len(_RGBA)],
                **TERRAIN_CONTACT,
            )


def build_stairs(course: Course, world: WorldConfig, random: np.random.Generator) -> Stairs:
    """Stairs at the end of the flat place, on the side that the way leads to along x.

    Args:
        course: where the team starts and walks.
        world: how high, deep and many the steps are.
        random: the terrain's random stream; up to a tread's depth the stairs begin later.
    """
    run, count = world.stairs_run, world.stairs_count
    first = course.flat.x_high + run * random.uniform()
    length = 2.0 * run * (count - 1) + _LANDING
    if course.way[-1, 0] < 0.0:
        first = course.flat.x_low - (first - course.flat.x_high) - length
    near = first + run * np.arange(count)
    return Stairs(
        risers=np.stack([near, 2.0 * first + length - near], axis=1),
        sides=course.extent.sides[1],
        rise=world.stairs_rise,
    )
