"""The external load on each robot: its mass and its place on the trunk."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from quadriga.shared.config.payload import carriers
from quadriga.shared.config.sections import Config
from quadriga.shared.robot.conventions import robot_names

_STREAM: Final = 5  # of the seed


@dataclass(frozen=True, slots=True)
class Load:
    """A robot's external load.

    Attributes:
        mass: kg; 0 if there is none.
        offset: of its centre from the trunk's, along the trunk's x and y, m.
    """

    mass: float
    offset: tuple[float, float] = (0.0, 0.0)

    @property
    def detail(self) -> str:
        """Detail of the event that announces the load."""
        x, y = self.offset
        where = f", {1000 * x:+.0f} mm ahead, {1000 * y:+.0f} mm left" if x or y else ""
        return f"{self.mass:.6g} kg{where}"


def build_loads(config: Config) -> tuple[Load, ...]:
    """The load on each robot; its place is drawn independently of the other robots' loads.

    Raises:
        ConfigError: `world.payload_on` does not parse or names no robot of the team.
    """
    world, n = config.world, config.team.robots
    parts = carriers(world.payload_on, robot_names(n))
    random, reach = np.random.default_rng((world.seed, _STREAM)), world.payload_scatter
    places = random.uniform(-reach, reach, (n, 2)).tolist()
    return tuple(
        Load(world.payload * part / sum(parts), (x, y) if reach else (0.0, 0.0))
        for part, (x, y) in zip(parts, places, strict=True)
    )
