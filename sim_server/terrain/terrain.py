"""The ground of a world: the one interface of all terrains, and where they are laid."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, Final, NamedTuple, Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from quadriga.shared.config.reference_trace import trace_of
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import Array

# Two geoms touch if one's `contype` has a bit of the other's `conaffinity`. The ground has bit 1,
# to which robots answer; loose stones touch ground, robots and each other by a second bit of their
# own; legs and trunks touch each other by the third. MuJoCo leaves out a body's contact with the
# one that it hangs on.
TERRAIN_CONTACT: Final = {"contype": 1, "conaffinity": 0}
ROBOT_CONTACT: Final = {"contype": 0, "conaffinity": 1}  # with the ground alone
LEG_CONTACT: Final = {"contype": 4, "conaffinity": 5}  # with the ground and with other legs
NO_CONTACT: Final = {"contype": 0, "conaffinity": 0}
STONE_CONTACT: Final = {"contype": 3, "conaffinity": 2}
GROUND_OF_STONES: Final = {"contype": 3, "conaffinity": 0}
PLANE, EARTH = "plane", "earth"  # materials
_Colour = tuple[float, float, float]
_COLOURS: Final[dict[str, tuple[_Colour, _Colour, float]]] = {  # light, dark, edge of a square, m
    PLANE: ((0.80, 0.82, 0.80), (0.70, 0.73, 0.71), 0.5),
    EARTH: ((0.60, 0.54, 0.42), (0.53, 0.47, 0.36), 0.2),
}
FOLLOW_MS: Final = 4  # ms between two calls of `MovingBodies.follow`
_HALF_BODY: Final = (0.25, 0.2)  # m, trunk origin to the farthest foot, along x and y
_FLAT_MARGIN: Final = 0.4  # m, flat ground around the feet of the spawned team …
_FLAT_AHEAD: Final = 0.5  # … and ahead of it
_AHEAD: Final = 3.0  # m of terrain beyond the end of the way
_BESIDE: Final = 1.0  # m of terrain beside the team, for a team that drifts
_RAMP: Final = 0.5  # m over which a height field rises from the flat ground
_LONGEST_WAY: Final = 40.0  # m; beyond it the ground is flat
_STEP: Final = 0.05  # s, of the nominal way


def add_checker(spec: mujoco.MjSpec, name: str) -> None:
    """Add one of these materials, made of squares, to a world under construction."""
    light, dark, square = _COLOURS[name]
    spec.add_texture(
        name=name,
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        width=256,
        height=256,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=light,
        rgb2=dark,
    )
    repeat = 0.5 / square  # the texture is two squares wide
    spec.add_material(
        name=name,
        texrepeat=[repeat, repeat],
        texuniform=True,
        textures=["", name],
        specular=0.1,
        shininess=0.1,
    )


class Stones(NamedTuple):
    """Loose stones as they lay before the walk."""

    poses: Array  # centre and attitude wxyz of each, shape (k, 7), m, world
    halves: Array  # half axes of each, shape (k, 3), m
    colours: Array  # RGB of each, 0 … 1, shape (k, 3)


class MovingBodies(Protocol):
    """Bodies of a terrain that feet can move, while a world runs."""

    def follow(self, feet: Array) -> None:
        """Update them between two ticks; `feet` are the centres of all feet, (f, 3), m, world."""


class Terrain:
    """The ground of a world: this is a plane at z = 0, other terrains override what they add to it.

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

    def height_under_hips(self, x: Array, y: Array, yaw: Array, feet: Array) -> Array:
        """Mean height of the ground where a robot's feet stand under its hips, m.

        Args:
            x: world positions of trunks, of any shape, m.
            y: of the same shape, m.
            yaw: of the same shape, rad.
            feet: `RobotSpec.feet_under_hips`, (4, 2), m.
        """
        cos, sin = np.cos(yaw)[..., None], np.sin(yaw)[..., None]
        mean: Array = self.height(
            x[..., None] + cos * feet[:, 0] - sin * feet[:, 1],
            y[..., None] + sin * feet[:, 0] + cos * feet[:, 1],
        ).mean(axis=-1)
        return mean

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Add what never moves, beside the plane, to a world under construction.

        The geoms' friction does not matter: that of feet and trunks takes priority.
        """

    def add_bodies(self, spec: mujoco.MjSpec, robots: int, friction: float) -> None:
        """Add the bodies that so many robots can move, after everything else."""

    def start(
        self, model: Any, physics: Any, robots: int, foot_radius: float
    ) -> MovingBodies | None:
        """Take over the bodies of `add_bodies` in a compiled world and its state; None: none."""
        return None

    def stones_near(self, centre: Array, most: int, reach: float = np.inf) -> Stones:
        """At most so many stones around a place, (2,), and so far from it, m; the nearest first."""
        return Stones(np.zeros((0, 7)), np.zeros((0, 3)), np.zeros((0, 3)))


def add_plane(spec: mujoco.MjSpec, *, loose: bool) -> None:
    """Add the plane z = 0, on which stones may lie loose, to a world under construction."""
    add_checker(spec, PLANE)
    spec.worldbody.add_geom(
        name="ground",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0.0, 0.0, 1.0],
        material=PLANE,
        **(GROUND_OF_STONES if loose else TERRAIN_CONTACT),
    )


@dataclass(frozen=True, slots=True)
class Rectangle:
    """An axis-aligned rectangle of the ground, m, world frame."""

    x_low: float
    x_high: float
    y_low: float
    y_high: float

    @property
    def sides(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Its limits along x and along y, m."""
        return (self.x_low, self.x_high), (self.y_low, self.y_high)

    def depth(self, x: Array, y: Array) -> Array:
        """Distance to the border, positive inside and negative outside, m."""
        dx = np.minimum(x - self.x_low, self.x_high - x)
        dy = np.minimum(y - self.y_low, self.y_high - y)
        outside = np.hypot(np.minimum(dx, 0.0), np.minimum(dy, 0.0))
        return np.where(outside > 0.0, -outside, np.minimum(dx, dy))


@dataclass(frozen=True, slots=True)
class Course:
    """The flat place under the spawned team and the rectangle that terrain fills around it."""

    flat: Rectangle
    extent: Rectangle
    way: Array  # nominal positions of the formation's centre, shape (m, 2), m
    reach: float  # m, how far from the way the team needs terrain

    def rise(self, x: Array, y: Array) -> Array:
        """Factor in [0, 1] by which a height field rises smoothly from its borders."""
        into = np.minimum(-self.flat.depth(x, y), self.extent.depth(x, y))
        return _smooth(into / _RAMP)

    def edge(self, x: Array, y: Array) -> Array:
        """Factor in [0, 1] that lowers the ground towards its outer borders alone."""
        return _smooth(self.extent.depth(x, y) / _RAMP)

    def needs(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Whether points lie within `reach` of the way."""
        square = np.full(np.shape(x), np.inf)
        for px, py in self.way.tolist():
            square = np.minimum(square, (x - px) ** 2 + (y - py) ** 2)
        return square <= self.reach**2


def _smooth(s: Array) -> Array:
    """A smooth step: 0 to 1 as s goes from 0 to 1."""
    s = np.clip(s, 0.0, 1.0)
    return s * s * (3.0 - 2.0 * s)


def build_course(config: Config, places: Array) -> Course:
    """The course of trunks that start at `places`, (n, 2), m: their reference and some margin."""
    low, high = places.min(axis=0) - _HALF_BODY, places.max(axis=0) + _HALF_BODY
    way, backward, turning = _way(config), config.reference.vx < 0.0, config.reference.wz != 0.0
    if config.reference.trace:  # it counts for its first metre: until the flat place is left
        left = np.linalg.norm(way, axis=1) >= _FLAT_AHEAD
        backward, turning = bool(way[left.argmax() if left.any() else -1, 0] < 0.0), True
    behind, ahead = (_FLAT_AHEAD, _FLAT_MARGIN) if backward else (_FLAT_MARGIN, _FLAT_AHEAD)
    flat = Rectangle(
        low[0] - behind, high[0] + ahead, low[1] - _FLAT_MARGIN, high[1] + _FLAT_MARGIN
    )
    way = (low + high) / 2.0 + way
    # A team that turns sweeps a circle; one that walks straight, the width of its formation.
    half = (high - low) / 2.0
    half = (np.full(2, np.hypot(*half)) if turning else half) + _BESIDE
    start, end = (way.min(axis=0) - half).tolist(), (way.max(axis=0) + half).tolist()
    extent = Rectangle(start[0], end[0], start[1], end[1])
    return Course(flat, extent, way, float(np.hypot(*half)))


def _way(config: Config) -> Array:
    """Nominal way of the formation's centre from the origin. Shape (m, 2), m."""
    ref, trace = config.reference, trace_of(config)
    if trace is None:
        longest = _LONGEST_WAY / max(math.hypot(ref.vx, ref.vy), 0.1)
        times = np.arange(0.0, min(config.world.duration, longest), _STEP)
        vx, vy, yaw = ref.vx, ref.vy, ref.wz * times
    else:
        times = np.arange(0.0, config.world.duration, _STEP)
        vx, vy, wz = np.array([trace.at(t) for t in times.tolist()]).T
        yaw = np.cumsum(_STEP * wz)
    step = _STEP * np.stack(
        [vx * np.cos(yaw) - vy * np.sin(yaw), vx * np.sin(yaw) + vy * np.cos(yaw)], axis=1
    )
    if trace is not None:
        length = np.cumsum(np.linalg.norm(step, axis=1))
        step = step[: max(1, int(np.searchsorted(length, _LONGEST_WAY)))]
    speed = float(np.linalg.norm(step[-1]))
    heading = step[-1] / speed if speed > 0.0 else np.array([1.0, 0.0])
    ahead = np.arange(0.0, _AHEAD, 0.2)[:, None] * heading
    walked = np.cumsum(step, axis=0)
    way: Array = np.concatenate([np.zeros((1, 2)), walked, walked[-1] + ahead])
    return way
