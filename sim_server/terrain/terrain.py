"""The ground: flat, with wooden blocks, stones or ramps, or a smooth height field."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Final

import mujoco
import numpy as np

from quadriga.shared.config.sections import Config
from quadriga.shared.robot.conventions import Array
from quadriga.sim_server.terrain.blocks import Blocks, build_blocks
from quadriga.sim_server.terrain.contact import GROUND_OF_STONES, TERRAIN_CONTACT
from quadriga.sim_server.terrain.course import Course, build_course
from quadriga.sim_server.terrain.height_field import (
    HeightField,
    build_gravel,
    build_ramps,
    build_smooth_field,
)
from quadriga.sim_server.terrain.pebbles import Pebbles, build_pebbles

_STREAM: Final = 1  # of the seed: the sensors draw from another one
_PLANE: Final = "plane"  # materials
_EARTH: Final = "earth"
_Colour = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Terrain:
    """The ground of a world: a plane at z = 0 and what lies on it.

    Attributes:
        relief: the blocks or the height field on the plane, or None; it never moves.
        pebbles: loose stones, or None. They do not count as height of the ground.
    """

    relief: Blocks | HeightField | None
    pebbles: Pebbles | None = None

    @property
    def top(self) -> float:
        """Height of the highest point, m."""
        return 0.0 if self.relief is None else self.relief.top

    def height(self, x: Array, y: Array) -> Array:
        """Height of the ground at world positions x, y of any equal shape, m."""
        return np.zeros(np.shape(x)) if self.relief is None else self.relief.height(x, y)

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
        """Add the ground to a world under construction.

        The geoms' friction does not matter: that of feet and trunks takes priority.
        """
        _add_checker(spec, _PLANE, (0.80, 0.82, 0.80), (0.70, 0.73, 0.71), 0.5)
        spec.worldbody.add_geom(
            name="ground",
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[0.0, 0.0, 1.0],
            material=_PLANE,
            **(TERRAIN_CONTACT if self.pebbles is None else GROUND_OF_STONES),
        )
        if isinstance(self.relief, Blocks):
            self.relief.add_to(spec, TERRAIN_CONTACT)
        elif self.relief is not None:
            _add_checker(spec, _EARTH, (0.60, 0.54, 0.42), (0.53, 0.47, 0.36), 0.2)
            self.relief.add_to(spec, TERRAIN_CONTACT, _EARTH)


def build_terrain(config: Config, places: Array) -> Terrain:
    """The terrain of a configuration, drawn from `world.seed`; flat under the spawned team.

    Args:
        config: the configuration.
        places: spawn positions of the trunks, shape (n, 2), m.
    """
    world = config.world
    if not world.uneven:
        return Terrain(None)
    build: Mapping[str, Callable[[Course, float, np.random.Generator], Blocks | HeightField]]
    build = {
        "boxes": build_blocks,
        "gravel": build_gravel,
        "heightfield": build_smooth_field,
        "slope": partial(build_ramps, slope=math.radians(world.slope)),
    }
    random = np.random.default_rng((world.seed, _STREAM))
    course = build_course(config, places)
    if world.terrain == "pebbles":
        return Terrain(None, build_pebbles(course, world.terrain_height, random))
    return Terrain(build[world.terrain](course, world.terrain_height, random))


def _add_checker(
    spec: mujoco.MjSpec, name: str, light: _Colour, dark: _Colour, square: float
) -> None:
    """A material of squares of the given edge length, m."""
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
