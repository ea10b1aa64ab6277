"""A layer of loose stones on flat ground: their poses, and the bodies of the few that can move."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import Any, ClassVar, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from quadriga.shared.config.sections import WorldConfig
from quadriga.shared.robots.conventions import N_LEGS, Array
from quadriga.sim_server.terrain.terrain import STONE_CONTACT, Course, Rectangle, Stones, Terrain

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
_MARGIN: Final = 0.01  # m around foot and stone; a foot moves less until the next update
_LOW: Final = 0.03  # m from the top of the largest stone to a foot that counts as near
_LEAVE: Final = 0.02  # m beyond the distance at which it got its body, a stone may lose it
_STILL: Final = (0.02, 1.0)  # m/s, rad/s
_NOBODY: Final = -1


@dataclass(frozen=True, slots=True)
class Pebbles(Terrain):
    """Stones as they lie before the walk."""

    loose: ClassVar[bool] = True
    pose: Array  # centre and attitude wxyz of each stone, shape (s, 7), m, world
    size: NDArray[np.int64]  # index of each stone's size in `_SIZES`, shape (s,)
    half: Array  # half axes of the stones of each size, shape (4, 3), m

    def add_bodies(self, spec: mujoco.MjSpec, robots: int, friction: float) -> None:
        """Add the bodies of stones that can move, parked, weightless and ordered by size."""
        apart = 4.0 * float(self.half.max())
        for k in range(count := _bodies(robots)):
            i = k * len(_SIZES) // count
            pos = [apart * k, 0.0, _PARKED]
            body = spec.worldbody.add_body(name=f"pebble{k}", pos=pos, gravcomp=1.0)
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
        return LooseStones(self, _bodies(robots), model, physics, foot_radius)

    def stones_near(self, centre: Array, most: int, reach: float = np.inf) -> Stones:
        """The stones around a place, the nearest first."""
        away = np.linalg.norm(self.pose[:, :2] - centre, axis=1)
        near = np.flatnonzero(away <= reach)
        if most < len(near):  # of a long way's million stones only the nearest are put in order
            near = near[np.argpartition(away[near], most)[:most]]
        nearest = near[np.argsort(away[near], kind="stable")]
        colours = np.array(_RGB)[nearest % len(_RGB)]
        return Stones(self.pose[nearest], self.half[self.size[nearest]], colours)


def _bodies(robots: int) -> int:
    """How many stones can move, as many of each size."""
    return len(_SIZES) * -(-_PER_LEG * N_LEGS * robots // len(_SIZES))


def build_pebbles(course: Course, world: WorldConfig, random: np.random.Generator) -> Pebbles:
    """Stones side by side wherever the team's way needs them, none on the flat place.

    The largest are `world.terrain_height` high.
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
    keep = (-course.flat.depth(*centre.T) > longest) & course.needs(*centre.T)
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


class LooseStones:
    """The assignment of bodies to stones, and the poses of all other stones.

    Thousands of free bodies would take longer to simulate than the robots. So the world has a few
    and lends one to every stone near a low foot, until the stone lies still and no foot is near.
    If none is left (`without` counts how often) the foot passes through the stone, because a stone
    that appears inside a foot would throw it away.
    """

    def __init__(
        self, stones: Pebbles, count: int, model: Any, physics: Any, foot_radius: float
    ) -> None:
        """Take over the last `count` bodies of a compiled world; `foot_radius` is in m."""
        self._parked = model.qpos0[-7 * count :].reshape(count, 7)
        self._q = physics.qpos[-7 * count :].reshape(count, 7)
        self._v = physics.qvel[-6 * count :].reshape(count, 6)
        self._warm = physics.qacc_warmstart[-6 * count :].reshape(count, 6)
        self._weightless = model.body_gravcomp[-count:]
        self._size, self._of_size = stones.size, np.arange(count) * len(stones.half) // count
        self._touching = foot_radius + float(stones.half.max())
        self._near = self._touching + _MARGIN
        self._on_top = 2.0 * float(stones.half[:, 2].max()) + foot_radius
        self.pose = stones.pose.copy()  # of every stone, as of when it last lay still
        self.stone_of = np.full(count, _NOBODY)  # the stone that each body is lent to
        self.without = 0
        self._cells: defaultdict[tuple[int, int], set[int]] = defaultdict(set)
        for stone in range(len(self.pose)):
            self._cells[self._cell(self.pose[stone])].add(stone)

    def follow(self, feet: Array) -> None:
        """See `MovingBodies`: lend bodies to stones near low feet, take them from those at rest."""
        low = feet[feet[:, 2] < self._on_top + _LOW]
        self._put_to_rest(low[:, :2])
        for stone in self._asleep_near(low):
            self._wake(stone)

    def _cell(self, place: Array) -> tuple[int, int]:
        return int(place[0] // self._near), int(place[1] // self._near)

    def _asleep_near(self, feet: Array) -> list[int]:
        """Stones without a body that a foot is near, but not inside, in order."""
        stones = set[int]()
        for x, y, z in feet.tolist():
            i, j = int(x // self._near), int(y // self._near)
            cells = (self._cells.get((i + a, j + b), ()) for a in (-1, 0, 1) for b in (-1, 0, 1))
            around = [stone for cell in cells for stone in cell]
            if around:
                places = self.pose[around, :2]
                square = (places[:, 0] - x) ** 2 + (places[:, 1] - y) ** 2
                close = square < self._near**2
                if z < self._on_top:
                    close &= square > self._touching**2
                stones.update(np.array(around)[close].tolist())
        return sorted(stones)

    def _wake(self, stone: int) -> None:
        free = np.flatnonzero((self._of_size == self._size[stone]) & (self.stone_of == _NOBODY))
        if not len(free):
            self.without += 1
            return
        body = int(free[0])
        self._cells[self._cell(self.pose[stone])].discard(stone)
        self._set(body, stone, self.pose[stone], weightless=0.0)

    def _put_to_rest(self, feet: Array) -> None:
        awake = np.flatnonzero(self.stone_of != _NOBODY)
        if not len(awake):
            return
        v = self._v[awake]
        still = np.linalg.norm(v[:, :3], axis=1) < _STILL[0]
        still &= np.linalg.norm(v[:, 3:], axis=1) < _STILL[1]
        if len(feet):
            away = self._q[awake, None, :2] - feet
            still &= np.linalg.norm(away, axis=-1).min(axis=1) > self._near + _LEAVE
        for body in awake[still].tolist():
            stone = int(self.stone_of[body])
            self.pose[stone] = self._q[body]
            self._cells[self._cell(self.pose[stone])].add(stone)
            self._set(body, _NOBODY, self._parked[body], weightless=1.0)

    def _set(self, body: int, stone: int, pose: Array, *, weightless: float) -> None:
        self.stone_of[body] = stone
        self._q[body], self._v[body], self._warm[body] = pose, 0.0, 0.0
        self._weightless[body] = weightless
