"""SHELL of a controller of one's own in Python: bus, barrier, words, status, signals, clean end."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from quadriga.agents.inbox import Inbox
from quadriga.agents.shell import answer_states
from quadriga.controller.stepped import Step, SteppedController, build_command
from quadriga.shared.agent_command import ENVIRONMENT
from quadriga.shared.codec import decode, encode
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError, QuadrigaError
from quadriga.shared.messages import State
from quadriga.shared.printable import printable_line
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.signals import stop_on_signals

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


def serve(step: Step, task: ControllerTask | None = None) -> None:
    """Be a robot's agent until the walk is over: each state is answered by `step`.

    `step(state, reference)` gets what the robot measures at a tick, and what the operator asks for,
    of which no speed is left while the team stands or is to stop; it gives the motor command, as
    `build_command` makes it. It is called once for each tick in lock-step; in real time for the
    newest state, within a millisecond. While an emergency stop is in force the joints are damped
    and it is not called.

    What takes long, as to load weights, is done before it is called.

    Args:
        step: the controller. What it remembers is its own.
        task: the robot and the team; by default what `quadriga` has started this program for.

    Raises:
        SystemExit: it cannot take part, or the team has vanished: status 1, and one line on
            stderr says why. What `step` raises goes through.
    """
    try:
        robot = task or read_task()
        stopped = stop_on_signals()
        agent = SteppedController(robot.config, robot.robot, step)
        inbox = Inbox(robot.config, robot.robot, peers=())
        answer_states(robot.config, agent, inbox, stopped, _load_codec)
    except QuadrigaError as error:
        print(printable_line(f"quadriga: {error}"), file=sys.stderr, flush=True)
        raise SystemExit(1) from None
    except KeyboardInterrupt:
        raise SystemExit(130) from None


def _load_codec() -> None:
    """Read and write a message of each kind: what does that is not loaded in the first tick."""
    still = State(0, 0, *(np.zeros(cut.stop - cut.start) for cut in State.CUTS.values()))
    encode(build_command(decode(encode(still), State)))
