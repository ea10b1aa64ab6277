"""What of a team never changes while one looks: its robots, yokes, loads and ground."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import Array, robot_names, yoke_pairs
from quadriga.sim_server.terrain.terrain import Terrain
from quadriga.sim_server.world.scenario import build_loads
from quadriga.sim_server.world.team_model import build_terrain, spawn_positions
from quadriga.view.skeleton import Skeleton


@dataclass(frozen=True, slots=True)
class TeamShape:
    """A team of n robots.

    Attributes:
        config: the team's configuration.
        robots: names.
        skeleton: of all robots.
        spawn: where trunks are before anything is heard, position and quaternion, shape (n, 7).
        yokes: pairs of indices of robots.
        loads: indices of the robots that carry something, and where the box on each is, trunk
            frame, shape (c, 3), m.
        terrain: the ground.
    """

    config: Config
    robots: tuple[str, ...]
    skeleton: Skeleton
    spawn: Array
    yokes: tuple[tuple[int, int], ...]
    loads: tuple[tuple[int, ...], Array]
    terrain: Terrain

    @property
    def count(self) -> int:
        """How many robots there are."""
        return len(self.robots)


def build_team_shape(config: Config) -> TeamShape:
    """The shape of a configuration's team.

    Raises:
        ConfigError: the payload names no robot, or the robot's URDF is missing.
    """
    n, robot = config.team.robots, config.robot
    spawn = np.zeros((n, 7))
    spawn[:, :2] = spawn_positions(config)
    spawn[:, 2], spawn[:, 3] = robot.stand_height, 1.0
    loads = build_loads(config)
    loaded = tuple(i for i, load in enumerate(loads) if load.mass > 0.0)
    boxes = np.array([[*load.offset, 0.0] for load in loads]) + robot.yoke
    return TeamShape(
        config=config,
        robots=robot_names(n),
        skeleton=Skeleton(robot, n),
        spawn=spawn,
        yokes=yoke_pairs(n, config.team.yokes),
        loads=(loaded, boxes[list(loaded)]),
        terrain=build_terrain(config),
    )
