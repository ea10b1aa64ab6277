"""SHELL: a controller of one's own in the place of a robot's agent: looked for, then become."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Final, NoReturn

from quadriga.shared.agent_command import KEY, environment_of, fill_in, parse_line
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError, system_reason
from quadriga.shared.link.connections import local_address
from quadriga.shared.members import plant_name

_PYTHON: Final = "python"  # the interpreter that this project runs in
_SCRIPT: Final = ".py"


def check_controller(config: Config) -> None:
    """Refuse a controller that cannot be started, before anything is.

    Raises:
        ConfigError: there is no such program, or no such script.
    """
    if not config.team.agent_command:
        return
    program, *rest = parse_line(config.team.agent_command)
    if program != _PYTHON and shutil.which(program) is None:
        raise ConfigError(KEY, f"no program {program!r}", "one in PATH, or the path of one")
    for word in rest[:1]:
        if word.endswith(_SCRIPT) and not Path(word).is_file():
            raise ConfigError(KEY, f"no file {word!r}", "a script, seen from where it is typed")


def places_of(config: Config, robot: str, file: Path) -> dict[str, str]:
    """What stands at each of `PLACES` for one robot.

    Args:
        config: the team's configuration.
        robot: the robot.
        file: holds the configuration.
    """
    bus, plant = config.bus, plant_name(robot if config.team.plant_per_robot else "")
    link = None if config.plant.link == "bus" else local_address(config, plant)
    return {
        "robot": robot,
        "team": config.team.name,
        "config": str(file.resolve()),
        "endpoint": bus.endpoint,
        "mode": bus.mode,
        "listen": bus.listen,
        "plant": plant,
        "link": "" if link is None else str(link),
    }


def become_controller(config: Config, places: Mapping[str, str]) -> NoReturn:
    """Become the controller: this process goes on as its program, with the same number and parent.

    Args:
        config: the team's configuration.
        places: of `places_of`.

    Raises:
        ConfigError: the program cannot be started.
    """
    program, *rest = fill_in(parse_line(config.team.agent_command), places)
    if program == _PYTHON:
        program = sys.executable
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    try:
        os.execvpe(program, [program, *rest], {**os.environ, **environment_of(places)})
    except OSError as error:
        got = f"{program!r}: {system_reason(error)}"
        raise ConfigError(KEY, got, "a program that can be started") from None
