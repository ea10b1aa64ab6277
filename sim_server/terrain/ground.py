"""Ground that never moves: wooden blocks, stairs, and heights over a grid."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product
from typing import Final

import mujoco
import numpy as np
from scipy import ndimage

from quadriga.shared.config.sections import WorldConfig
from quadriga.shared.robots.conventions import Array
from quadriga.sim_server.terrain.terrain import (
    EARTH,
    TERRAIN_CONTACT,
    Course,
    Rectangle,
    Terrain,
    add_checker,
)

_CELL: Final = 0.35  # m, one block per square of this size
_SIZE: Final = (0.1, 0.4)  # m, range of the horizontal edges
_LEAST_HEIGHT: Final = 0.2  # of the greatest height
_AT_ONCE: Final = 64  # positions: so few that the caches hold what is in between
_BLOCK_RGBA: Final = ((0.72, 0.53, 0.30, 1.0), (0.80, 0.62, 0.38, 1.0), (0.62, 0.44, 0.24, 1.0))
_LANDING: Final = 1.5  # m, between the last riser up and the first one down
_STEP_RGBA: Final = ((0.66, 0.66, 0.64, 1.0), (0.58, 0.58, 0.57, 1.0))  # every second step
_SUNK: Final = 0.01  # m, how far below the ground plane the field starts: no double contacts there
_BASE: Final = 0.05  # m, thickness below the lowest point

_SMOOTH_CELL: Final = 0.05  # m, grid of the smooth field
_SMOOTH_LENGTH: Final = 0.35  # m, distance at which the correlation of its heights is 1/e

_RAMP_CELL: Final = 0.04  # m, grid of the ramps
_LEAST_CREST: Final = 0.5  # of the highest
_RAMP_TURN: Final = math.radians(20.0)  # greatest angle between x and the way the ramps face
_ROUNDED: Final = 0.08  # m, standard deviation of the filter that rounds each crest
_FILTER: Final = 3.0  # reach of the filter in standard deviations

_GRAVEL_CELL: Final = 0.015  # m, grid of the gravel
_STONE_CELL: Final = 0.035  # m, one stone per square of this size
_STONE_RADIUS: Final = (0.015, 0.03)  # m
_STONE_HEIGHT: Final = 0.015  # m, how far the largest stone stands out of its bed
_BED_LENGTH: Final = 0.15  # m, correlation length of the bed that the stones lie on


@dataclass(frozen=True, slots=True)
class BoxTerrain(Terrain):
    """Upright boxes; where some overlap the highest counts."""

    centre: Array  # shape (b, 3), m, world
    half: Array  # half edge lengths along the box's own axes, shape (b, 3), m
    yaw: Array  # headings, shape (b,), rad
    tall: Array  # heights of their tops above the plane, shape (b,), m
    colours: tuple[tuple[float, ...], ...]  # RGBA, which the boxes have in turn

    @property
    def top(self) -> float:
        """Height of the highest box, m."""
        return float(self.tall.max(initial=0.0))

    def height(self, x: Array, y: Array) -> Array:
        """Height of the highest box at each position, or zero. Shape of x, m."""
        x, y = np.asarray(x), np.asarray(y)
        height, cos, sin = np.empty(x.size), np.cos(self.yaw), np.sin(self.yaw)
        for first in range(0, x.size, _AT_ONCE):
            part = slice(first, first + _AT_ONCE)
            dx = x.reshape(-1)[part, None] - self.centre[:, 0]
            dy = y.reshape(-1)[part, None] - self.centre[:, 1]
            inside = np.abs(cos * dx + sin * dy) <= self.half[:, 0]
            inside &= np.abs(cos * dy - sin * dx) <= self.half[:, 1]
            height[part] = np.where(inside, self.tall, 0.0).max(axis=-1, initial=0.0)
        return height.reshape(x.shape)

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Add one box geom each to the world body."""
        for i, yaw in enumerate(self.yaw):
            spec.worldbody.add_geom(
                type=mujoco.mjtGeom.mjGEOM_BOX,
                pos=self.centre[i],
                size=self.half[i],
                quat=[np.cos(yaw / 2.0), 0.0, 0.0, np.sin(yaw / 2.0)],
                rgba=self.colours[i % len(self.colours)],
                **TERRAIN_CONTACT,
            )


def build_blocks(course: Course, world: WorldConfig, random: np.random.Generator) -> BoxTerrain:
    """One block per cell of the course that the team's way needs, none on the flat place.

    Heights are uniform in 0.2 … 1 of `world.terrain_height`.
    """
    (x_low, x_high), (y_low, y_high) = course.extent.sides
    x, y = np.meshgrid(np.arange(x_low, x_high, _CELL), np.arange(y_low, y_high, _CELL))
    centre = np.stack([x.ravel(), y.ravel()], axis=1)
    centre += random.uniform(0.0, _CELL, centre.shape)
    half = random.uniform(_SIZE[0] / 2.0, _SIZE[1] / 2.0, centre.shape)
    yaw = random.uniform(0.0, np.pi, len(centre))
    tall = world.terrain_height * random.uniform(_LEAST_HEIGHT, 1.0, len(centre))
    keep = -course.flat.depth(*centre.T) > np.hypot(*half.T)
    keep &= course.needs(*centre.T)
    up = tall[:, None] / 2.0
    centre, half = np.hstack([centre, up]), np.hstack([half, up])
    return BoxTerrain(centre[keep], half[keep], yaw[keep], tall[keep], _BLOCK_RGBA)


def build_stairs(course: Course, world: WorldConfig, random: np.random.Generator) -> BoxTerrain:
    """Boxes on top of each other, each a tread shorter at both ends: their sides are the risers.

    They lie at the end of the flat place, on the side that the way leads to along x, and begin up
    to a tread's depth later.
    """
    run, rise, step = (
        world.stairs_run,
        world.stairs_rise,
        np.arange(world.stairs_count, dtype=float),
    )
    first = course.flat.x_high + run * random.uniform()
    length = 2.0 * run * (world.stairs_count - 1) + _LANDING
    if course.way[-1, 0] < 0.0:
        first = course.flat.x_low - (first - course.flat.x_high) - length
    near, (right, left) = first + run * step, course.extent.sides[1]
    far, flat = 2.0 * first + length - near, np.zeros(step.shape)
    centre = np.stack(
        [(near + far) / 2.0, flat + (right + left) / 2.0, (step + 0.5) * rise], axis=1
    )
    half = np.stack([(far - near) / 2.0, flat + (left - right) / 2.0, flat + rise / 2.0], axis=1)
    tall = rise * (step + 1.0)
    return BoxTerrain(centre, half, flat, tall, _STEP_RGBA)


@dataclass(frozen=True, slots=True)
class HeightField(Terrain):
    """Heights over a regular grid, two triangles per cell; the plane z = 0 covers what is lower."""

    extent: Rectangle  # the ground covered
    z: Array  # heights, row r along y and column c along x, shape (rows, columns), m

    @property
    def top(self) -> float:
        """Height of the highest point, m."""
        return max(0.0, float(self.z.max()))

    def height(self, x: Array, y: Array) -> Array:
        """Height of the surface that feet touch, at positions of any equal shape, m."""
        (rows, columns), box = self.z.shape, self.extent
        c = (np.asarray(x) - box.x_low) / (box.x_high - box.x_low) * (columns - 1)
        r = (np.asarray(y) - box.y_low) / (box.y_high - box.y_low) * (rows - 1)
        inside = (c >= 0.0) & (c <= columns - 1) & (r >= 0.0) & (r <= rows - 1)
        c0 = np.clip(np.floor(np.where(inside, c, 0.0)).astype(int), 0, columns - 2)
        r0 = np.clip(np.floor(np.where(inside, r, 0.0)).astype(int), 0, rows - 2)
        u, v = c - c0, r - r0
        z00, z01 = self.z[r0, c0], self.z[r0, c0 + 1]
        z10, z11 = self.z[r0 + 1, c0], self.z[r0 + 1, c0 + 1]
        # MuJoCo splits each cell along the diagonal from (r, c) to (r + 1, c + 1).
        below = z00 + u * (z01 - z00) + v * (z11 - z01)
        above = z00 + u * (z11 - z10) + v * (z10 - z00)
        surface = np.where(u >= v, below, above)
        return np.where(inside, np.maximum(surface, 0.0), 0.0)

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Add the field as one geom of the world body."""
        add_checker(spec, EARTH)
        (x_low, x_high), (y_low, y_high) = self.extent.sides
        half_x, half_y = (x_high - x_low) / 2.0, (y_high - y_low) / 2.0
        (rows, columns), low = self.z.shape, float(self.z.min())
        size = [half_x, half_y, float(self.z.max()) - low, _BASE]
        spec.add_hfield(name="terrain", nrow=rows, ncol=columns, userdata=self.z.ravel(), size=size)
        spec.worldbody.add_geom(
            name="terrain",
            type=mujoco.mjtGeom.mjGEOM_HFIELD,
            hfieldname="terrain",
            pos=[x_low + half_x, y_low + half_y, low],
            material=EARTH,
            **TERRAIN_CONTACT,
        )


def build_smooth_field(
    course: Course, world: WorldConfig, random: np.random.Generator
) -> HeightField:
    """Gaussian hills between 0 and `world.terrain_height`."""
    x, y = _grid(course.extent, _SMOOTH_CELL)
    hills = _hills(x.shape, _SMOOTH_LENGTH / _SMOOTH_CELL, random)
    return _field(course, x, y, hills, world.terrain_height)


def build_gravel(course: Course, world: WorldConfig, random: np.random.Generator) -> HeightField:
    """Stones of 3 to 6 cm on an uneven bed, between 0 and `world.terrain_height`.

    The stones are part of the ground: they do not move, roll or sink.
    """
    x, y = _grid(course.extent, _GRAVEL_CELL)
    height = world.terrain_height
    stand_out = min(_STONE_HEIGHT, height)
    bed = _hills(x.shape, _BED_LENGTH / _GRAVEL_CELL, random)
    z = (height - stand_out) * bed + stand_out * _stones(course.extent, x, y, random)
    return _field(course, x, y, z, height)


def build_ramps(course: Course, world: WorldConfig, random: np.random.Generator) -> HeightField:
    """Ramps of `world.slope` up and down again, one after the other, as wide as the ground.

    Crests are uniform in 0.5 … 1 of `world.terrain_height`.
    """
    x, y = _grid(course.extent, _RAMP_CELL)
    heading = random.uniform(-_RAMP_TURN, _RAMP_TURN)
    way = np.array([np.cos(heading), np.sin(heading)])
    corners = np.array(list(product(*course.flat.sides)))
    along, grade = way[0] * x + way[1] * y, np.tan(math.radians(world.slope))
    profile = np.zeros_like(along)
    for side in (1.0, -1.0):  # ramps at both ends: a team may walk backwards
        foot = float((side * corners @ way).max()) + _FILTER * _ROUNDED
        while foot < float((side * along).max()):
            crest = _SUNK + world.terrain_height * random.uniform(_LEAST_CREST, 1.0)
            half = crest / grade
            profile = np.maximum(profile, crest - grade * np.abs(side * along - foot - half))
            foot += 2.0 * half
    z = ndimage.gaussian_filter(profile, _ROUNDED / _RAMP_CELL, mode="nearest", truncate=_FILTER)
    return HeightField(course.extent, course.edge(x, y) * z - _SUNK)


def _stones(extent: Rectangle, x: Array, y: Array, random: np.random.Generator) -> Array:
    """Height of the highest of many random ellipsoids at each grid point, in [0, 1]."""
    cx, cy = _grid(extent, _STONE_CELL)
    cx, cy = (a.ravel() + random.uniform(0.0, _STONE_CELL, a.size) for a in (cx, cy))
    radius = random.uniform(*_STONE_RADIUS, cx.size)
    tall = radius / _STONE_RADIUS[1]
    dx, dy = x[0, 1] - x[0, 0], y[1, 0] - y[0, 0]
    c0 = np.rint((cx - x[0, 0]) / dx).astype(int)
    r0 = np.rint((cy - y[0, 0]) / dy).astype(int)
    reach = int(np.ceil(_STONE_RADIUS[1] / min(dx, dy)))
    z = np.zeros(x.shape)
    for row in range(-reach, reach + 1):
        for column in range(-reach, reach + 1):
            r = np.clip(r0 + row, 0, x.shape[0] - 1)
            c = np.clip(c0 + column, 0, x.shape[1] - 1)
            away = ((x[r, c] - cx) ** 2 + (y[r, c] - cy) ** 2) / radius**2
            np.maximum.at(z, (r, c), tall * np.sqrt(np.clip(1.0 - away, 0.0, None)))
    return z


def _hills(shape: tuple[int, ...], length: float, random: np.random.Generator) -> Array:
    """Smooth random heights from 0 to 1 whose correlation falls to 1/e over `length` cells.

    White noise filtered by a Gaussian of deviation s has the correlation exp(−r² / 4 s²).
    """
    z = ndimage.gaussian_filter(random.standard_normal(shape), length / 2.0, mode="reflect")
    hills: Array = (z - z.min()) / (z.max() - z.min())
    return hills


def _grid(extent: Rectangle, cell: float) -> tuple[Array, Array]:
    """Positions of grid points at most `cell` apart, two arrays of shape (rows, columns), m."""
    counts = (int(np.ceil((high - low) / cell)) + 1 for low, high in extent.sides)
    lines = (np.linspace(*ends, n) for ends, n in zip(extent.sides, counts, strict=True))
    x, y = np.meshgrid(*lines)
    return x, y


def _field(course: Course, x: Array, y: Array, z: Array, height: float) -> HeightField:
    """The field, scaled so that its highest point off the flat place is `height`."""
    rise = course.rise(x, y)
    z = z * (height / (rise * z).max())
    return HeightField(course.extent, rise * (z + _SUNK) - _SUNK)
