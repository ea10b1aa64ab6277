"""Wooden blocks: boxes of random size, heading and height that lie fixed on flat ground."""

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

_CELL: Final = 0.35  # m, one block per square of this size
_SIZE: Final = (0.1, 0.4)  # m, range of the horizontal edges
_LEAST_HEIGHT: Final = 0.2  # of the greatest height
_AT_ONCE: Final = 64  # positions whose heights are computed together
_RGBA: Final = ((0.72, 0.53, 0.30, 1.0), (0.80, 0.62, 0.38, 1.0), (0.62, 0.44, 0.24, 1.0))


@dataclass(frozen=True, slots=True)
class Blocks(Relief):
    """Blocks on the ground; where two overlap the higher one counts.

    Attributes:
        centre: horizontal centres, shape (b, 2), m, world.
        half: half edge lengths along the block's own axes, shape (b, 2), m.
        yaw: headings, shape (b,), rad.
        tall: heights above the ground, shape (b,), m.
    """

    centre: Array
    half: Array
    yaw: Array
    tall: Array

    @property
    def top(self) -> float:
        """Height of the highest block, m."""
        return float(self.tall.max(initial=0.0))

    def height(self, x: Array, y: Array) -> Array:
        """Height of the highest block at each position, or zero. Shape of x, m."""
        x, y = np.asarray(x), np.asarray(y)
        height = np.empty(x.size)
        for first in range(0, x.size, _AT_ONCE):
            part = slice(first, first + _AT_ONCE)
            height[part] = self._heights(x.reshape(-1)[part], y.reshape(-1)[part])
        return height.reshape(x.shape)

    def _heights(self, x: Array, y: Array) -> Array:
        """The same for so few positions that the processor's caches hold what is in between."""
        dx = x[:, None] - self.centre[:, 0]
        dy = y[:, None] - self.centre[:, 1]
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        inside = np.abs(cos * dx + sin * dy) <= self.half[:, 0]
        inside &= np.abs(cos * dy - sin * dx) <= self.half[:, 1]
        height: Array = np.where(inside, self.tall, 0.0).max(axis=-1, initial=0.0)
        return height

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Add one box geom per block to the world body."""
        for i in range(len(self.tall)):
            h = float(self.tall[i]) / 2.0
            spec.worldbody.add_geom(
                type=mujoco.mjtGeom.mjGEOM_BOX,
                pos=[*self.centre[i], h],
                size=[*self.half[i], h],
                quat=[np.cos(self.yaw[i] / 2.0), 0.0, 0.0, np.sin(self.yaw[i] / 2.0)],
                rgba=_RGBA[i % len(_RGBA)],
                **TERRAIN_CONTACT,
            )


def build_blocks(course: Course, world: WorldConfig, random: np.random.Generator) -> Blocks:
    """One block per cell of the course that the team's way needs, none on the flat place.

    Args:
        course: where the team starts and walks.
        world: how high the highest block may be; heights are uniform in 0.2 … 1 of that.
        random: the terrain's random stream.
    """
    extent = course.extent
    x, y = np.meshgrid(
        np.arange(extent.x_low, extent.x_high, _CELL), np.arange(extent.y_low, extent.y_high, _CELL)
    )
    centre = np.stack([x.ravel(), y.ravel()], axis=1)
    centre += random.uniform(0.0, _CELL, centre.shape)
    half = random.uniform(_SIZE[0] / 2.0, _SIZE[1] / 2.0, centre.shape)
    yaw = random.uniform(0.0, np.pi, len(centre))
    tall = world.terrain_height * random.uniform(_LEAST_HEIGHT, 1.0, len(centre))
    clear = -course.flat.depth(centre[:, 0], centre[:, 1]) > np.hypot(half[:, 0], half[:, 1])
    keep = clear & course.needs(centre[:, 0], centre[:, 1])
    return Blocks(centre=centre[keep], half=half[keep], yaw=yaw[keep], tall=tall[keep])
