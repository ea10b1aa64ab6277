"""The ground of a world: a plane, and what the configured terrain lays on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Final

import mujoco
import numpy as np

from quadriga.shared.config.sections import Config, WorldConfig
from quadriga.shared.config.terrains import TERRAINS
from quadriga.shared.robots.conventions import Array
from quadriga.sim_server.terrain.relief import (
    GROUND_OF_STONES,
    PLANE,
    TERRAIN_CONTACT,
    Course,
    Relief,
    add_checker,
    build_course,
)

_STREAM: Final = 1  # of the seed: the sensors draw from another one
_Builder = Callable[[Course, WorldConfig, np.random.Generator], Relief]


@dataclass(frozen=True, slots=True)
class Terrain:
    """The ground of a world: a plane at z = 0 and what lies on it.

    Attributes:
        relief: what lies on the plane.
    """

    relief: Relief

    @property
    def top(self) -> float:
        """Height of the highest point, m."""
        return self.relief.top

    def height(self, x: Array, y: Array) -> Array:
        """Height of the ground at world positions x, y of any equal shape, m."""
        return self.relief.height(x, y)

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
        add_checker(spec, PLANE)
        spec.worldbody.add_geom(
            name="ground",
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[0.0, 0.0, 1.0],
            material=PLANE,
            **(GROUND_OF_STONES if self.relief.loose else TERRAIN_CONTACT),
        )
        self.relief.add_to(spec)


def build_terrain(config: Config, places: Array) -> Terrain:
    """The terrain of a configuration, drawn from `world.seed`; flat under the spawned team.

    Args:
        config: the configuration.
        places: spawn positions of the trunks, shape (n, 2), m.
    """
    world = config.world
    if not world.uneven:
        return Terrain(Relief())
    random = np.random.default_rng((world.seed, _STREAM))
    build = _builder(world.terrain)
    return Terrain(build(build_course(config, places), world, random))


def _builder(name: str) -> _Builder:
    """The function that the table of terrains names."""
    module, _, function = TERRAINS[name].builder.partition(":")
    build: _Builder = getattr(import_module(f"quadriga.sim_server.terrain.{module}"), function)
    return build
