"""A layer of loose stones on flat ground: their poses, and the bodies of the few that can move."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from quadriga.shared.config.world import WorldConfig
from quadriga.shared.robot.conventions import N_LEGS, Array
from quadriga.sim_server.terrain.contact import STONE_CONTACT
from quadriga.sim_server.terrain.course import Course, Rectangle
from quadriga.sim_server.terrain.loose import LooseStones
from quadriga.sim_server.terrain.relief import Relief, Stones

_SIZES: Final = (0.5, 0.67, 0.83, 1.0)  # of the largest
_AXES: Final = (1.3, 1.1, 1.0)  # half axes of a stone over half its height
_CELL: Final = 2.1  # half lengths of the largest stone; one stone per square of this size
_DENSITY: Final = 2600.0  # kg/m³
_ROLLING: Final = 0.004  # m, rolling friction: a real stone has edges
_PER_LEG: Final = 10  # stones that can move, of all sizes
# Hard: a light stone between foot and ground must not be pressed into either.
_SOLREF: Final = (0.004, 1.0)  # s, damping ratio
_SOLIMP: Final = (0.99, 0.999, 0.001, 0.5, 2.0)
_PARKED: Final = 500.0  # m, height of those not in use
_RGB: Final = ((0.52, 0.50, 0.47), (0.60, 0.56, 0.50), (0.44, 0.43, 0.42), (0.56, 0.49, 0.42))


@dataclass(frozen=True, slots=True)
class Pebbles(Relief):
    """Stones as they lie before the walk.

    Attributes:
        pose: centre and attitude wxyz of each stone, shape (s, 7), m, world.
        size: index of each stone's size in `_SIZES`, shape (s,).
        half: half axes of the stones of each size, shape (4, 3), m.
    """

    loose: ClassVar[bool] = True
    pose: Array
    size: NDArray[np.int64]
    half: Array

    @property
    def reach(self) -> float:
        """Greatest half axis of the largest stones, m."""
        return float(self.half.max())

    def parking_poses(self, robots: int) -> Array:
        """Poses of the unused bodies of stones, ordered by size, m, world. Shape (p, 7)."""
        count = len(_SIZES) * -(-_PER_LEG * N_LEGS * robots // len(_SIZES))
        parked = np.zeros((count, 7))
        parked[:, 0] = 4.0 * self.reach * np.arange(count)
        parked[:, 2], parked[:, 3] = _PARKED, 1.0
        return parked

    def add_bodies(self, spec: mujoco.MjSpec, robots: int, friction: float) -> None:
        """Add the bodies of stones that can move, parked and weightless, after everything else."""
        parked = self.parking_poses(robots)
        for k, pose in enumerate(parked.tolist()):
            i = k * len(_SIZES) // len(parked)
            body = spec.worldbody.add_body(name=f"pebble{k}", pos=pose[:3], gravcomp=1.0)
            body.add_freejoint()
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_ELLIPSOID,
                size=self.half[i],
                density=_DENSITY,
                priority=2,
                condim=6,
                friction=[friction, 0.005, _ROLLING],
                solref=_SOLREF,
                solimp=_SOLIMP,
                rgba=[*_RGB[i], 1.0],
                **STONE_CONTACT,
            )

    def start(self, model: Any, physics: Any, robots: int, foot_radius: float) -> LooseStones:
        """Lend the bodies of a compiled world to stones near feet."""
        return LooseStones(self, self.parking_poses(robots), model, physics, foot_radius)

    def stones_near(self, centre: Array, most: int, reach: float = np.inf) -> Stones:
        """The stones around a place, the nearest first."""
        away = np.linalg.norm(self.pose[:, :2] - centre, axis=1)
        near = np.flatnonzero(away <= reach)
        if most < len(near):  # of a long way's million stones only the nearest are put in order
            near = near[np.argpartition(away[near], most)[:most]]
        nearest = near[np.argsort(away[near], kind="stable")]
        colours = np.array(_RGB)[nearest % len(_RGB)]
        return Stones(self.pose[nearest], self.half[self.size[nearest]], colours)


def build_pebbles(course: Course, world: WorldConfig, random: np.random.Generator) -> Pebbles:
    """Stones side by side wherever the team's way needs them, none on the flat place.

    Args:
        course: where the team starts and walks.
        world: how high the largest stones are.
        random: the terrain's random stream.
    """
    half = 0.5 * world.terrain_height * np.outer(_SIZES, _AXES)
    longest = float(half.max())
    centre = _lattice(course.extent, _CELL * longest, random)
    free = (0.5 * _CELL - 1.0) * longest
    size = random.integers(len(_SIZES), size=len(centre))
    # Each stone lies in its square; a smaller stone may lie farther off its middle.
    turn, away = random.uniform(0.0, 2.0 * np.pi, len(centre)), random.uniform(size=len(centre))
    away *= free + longest - half[size, 0]
    centre += np.stack([away * np.cos(turn), away * np.sin(turn)], axis=1)
    yaw = random.uniform(0.0, np.pi, len(centre))
    keep = -course.flat.depth(centre[:, 0], centre[:, 1]) > longest
    keep &= course.needs(centre[:, 0], centre[:, 1])
    pose = np.zeros((len(centre), 7))
    pose[:, :2], pose[:, 2] = centre, half[size, 2]
    pose[:, 3], pose[:, 6] = np.cos(yaw / 2.0), np.sin(yaw / 2.0)
    return Pebbles(pose=pose[keep], size=size[keep], half=half)


def _lattice(extent: Rectangle, cell: float, random: np.random.Generator) -> Array:
    """Middles of squares that fill a rectangle. Shape (s, 2), m, world.

    The rows are turned and shifted at random, so that no robot walks along them.
    """
    (x_low, x_high), (y_low, y_high) = extent.sides
    reach = 0.5 * float(np.hypot(x_high - x_low, y_high - y_low))
    u, v = np.meshgrid(np.arange(-reach, reach, cell), np.arange(-reach, reach, cell))
    u = u + random.uniform(0.0, cell, (len(u), 1))
    heading = random.uniform(0.0, np.pi)
    x = 0.5 * (x_low + x_high) + (u * np.cos(heading) - v * np.sin(heading)).ravel()
    y = 0.5 * (y_low + y_high) + (u * np.sin(heading) + v * np.cos(heading)).ravel()
    inside = extent.depth(x, y) > 0.0
    return np.stack([x[inside], y[inside]], axis=1)
