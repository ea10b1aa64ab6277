"""Which numbers a motor command can mean: none beyond drives a robot, simulated or real.

Every finite number passes the wire. A gain of 1e300 makes the sum that a motor forms infinite minus
infinite, which is no number, and then the whole world that it moves is none.

Whoever may publish on a robot's key can still command all that is within these limits.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from quadriga.shared.robot.conventions import Array
from quadriga.shared.robot.spec import RobotSpec
from quadriga.shared.runtime.jit import compiled
from quadriga.shared.wire.messages import Command

MOST_KP: Final = 500.0  # N·m/rad, stiffer than any of these robots' motors are run
MOST_KD: Final = 30.0  # N·m·s/rad
# What is asked for may exceed what the robot can do: motors and bridges cut that off.
_TIMES: Final = 2.0  # times the greatest torque, and the greatest speed
_BEYOND: Final = 1.0  # rad beyond the joint's range


class CommandLimits(NamedTuple):
    """Least and greatest numbers of a command's row, (60,) each."""

    least: Array
    most: Array


def command_limits(robot: RobotSpec) -> CommandLimits:
    """The limits of a kind of robot. Zeros, which damp nothing and hold nothing, are within."""
    speed = np.tile(robot.speed, 4)
    angle = np.maximum(np.abs(robot.lower), np.abs(robot.upper)) + _BEYOND
    bounds = {
        "tau": _TIMES * robot.torque_limit,
        "q_des": angle,
        "v_des": _TIMES * speed,
        "kp": np.full_like(speed, MOST_KP),
        "kd": np.full_like(speed, MOST_KD),
    }
    most = np.concatenate([bounds[name] for name in Command.CUTS])
    least = -most
    for gain in ("kp", "kd"):  # one below zero drives what it should hold
        least[Command.CUTS[gain]] = 0.0
    return CommandLimits(least, most)


def describe_excess(command: Command, limits: CommandLimits) -> str:
    """Which number of a command is beyond the limits, in words; "" if none is."""
    at = _first_beyond(command.row, limits.least, limits.most)
    if at < 0:
        return ""
    name = next(name for name, cut in Command.CUTS.items() if at < cut.stop)
    least, most = limits.least[at], limits.most[at]
    return f"command.{name}: got {command.row[at]:g}, expected {least:g} … {most:g}"


@compiled
def _first_beyond(row: Array, least: Array, most: Array) -> int:
    """Index of the first number beyond its limits, −1 if there is none."""
    for k in range(len(row)):
        if not least[k] <= row[k] <= most[k]:
            return k
    return -1
