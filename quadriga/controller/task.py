"""Which robot this program is to walk, in which team: what whoever starts it has told it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from quadriga.shared.agent_command import ENVIRONMENT
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.robots.conventions import robot_names

_ROBOT: Final = f"{ENVIRONMENT}ROBOT"
_CONFIG: Final = f"{ENVIRONMENT}CONFIG"
_CAUSE: Final = "`quadriga walk --controller`, or `quadriga agent --robot NAME`, starts it so"


@dataclass(frozen=True, slots=True)
class ControllerTask:
    """What a controller of one's own is for.

    Attributes:
        robot: the robot's name, r1 … rn.
        config: the team's configuration; `config.robot` is the kind of robot.
    """

    robot: str
    config: Config


def read_task(environment: Mapping[str, str] = os.environ) -> ControllerTask:
    """The task that the environment tells, as `quadriga` starts a controller.

    Raises:
        ConfigError: it tells none, or the configuration cannot be read.
    """
    for name in (_ROBOT, _CONFIG):
        if not environment.get(name):
            raise ConfigError(
                name, "nothing in the environment", "a robot's name and a file", _CAUSE
            )
    robot, config = environment[_ROBOT], load(Path(environment[_CONFIG]))
    names = robot_names(config.team.robots)
    if robot not in names:
        raise ConfigError(_ROBOT, repr(robot), f"one of {', '.join(names)}")
    return ControllerTask(robot, config)
