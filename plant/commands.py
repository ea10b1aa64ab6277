"""Commands as they arrive at the plant: checked and aged; late ones are held, then lost.

A gain of 1e300 makes the sum that a motor forms infinite minus
infinite, which is no number, and then the whole world that it moves is none. So none beyond the
limits drives a robot, simulated or real. A robot's agent can still command all that is within them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from typing import Final

import numpy as np

from quadriga.shared.config.sections import WorldConfig
from quadriga.shared.messages import Command, State
from quadriga.shared.robots.conventions import N_JOINTS, Array
from quadriga.shared.robots.spec import RobotSpec
from quadriga.shared.runtime.jit import compiled

MOST_KP: Final = 500.0  # N·m/rad, stiffer than any of these robots' motors are run
MOST_KD: Final = 30.0  # N·m·s/rad
# What is asked for may exceed what the robot can do: motors and bridges cut that off.
_TIMES: Final = 2.0  # times the greatest torque, and the greatest speed
_BEYOND: Final = 1.0  # rad beyond the joint's range
PROMPT_TICKS: Final = 10  # for which commands must be prompt after one was late
MOST_HELD_MS: Final = 1000  # then commands are as good as lost: yokes tip over who is held
MOTOR_DAMPING: Final = 2.0  # N·m·s/rad, damping of a motor without a command
_HOLD_KP: Final = 80.0  # N·m/rad, carries a standing robot
_HOLD_KD: Final = 3.0  # N·m·s/rad


def command_limits(robot: RobotSpec) -> tuple[Array, Array]:
    """Least and greatest numbers of a command's row, (60,) each, of a kind of robot.

    Zeros, which damp nothing and hold nothing, are within.
    """
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
    return least, most


class CommandBox:
    """The newest valid command of every robot, and what was refused.

    Args:
        robot: the kind of the robots.

    Attributes:
        latest: by robot, in no particular order.
        invalid: number of a robot's commands that no process of this project sends.
        errors: by robot, what was wrong with the latest of those.
        refused: by robot, what was wrong with the latest command, if it does not count.
    """

    def __init__(self, robot: RobotSpec) -> None:
        self._least, self._most = command_limits(robot)
        self.latest: dict[str, Command] = {}
        self.invalid: Counter[str] = Counter()
        self.errors: dict[str, str] = {}
        self.refused: dict[str, str] = {}
        _first_beyond(self._least, self._least, self._most)  # compiled, or loaded, now

    def tick_of(self, robot: str) -> int:
        """Tick of the robot's newest command, −1 before the first."""
        known = self.latest.get(robot)
        return -1 if known is None else known.tick

    def take(self, robot: str, command: Command, tick: int, oldest: int) -> bool:
        """Take in a robot's command; whether it is newer than what was known.

        Refused are a command with numbers beyond `command_limits`, and one of a tick before
        `oldest` or after `tick`, the newest of which the robots' states are published. Of two
        commands of one tick the first counts: the plant cannot know which of them is meant. That
        they differ is told.
        """
        known = self.latest.get(robot)
        if known is not None and command.tick == known.tick:
            if command.row.tobytes() != known.row.tobytes():
                differ = f"command: got two of tick {command.tick} for {robot}, expected one"
                self.refuse(robot, f"{differ} (does someone else command it?)")
            return False
        first = max(oldest, 0 if known is None else known.tick + 1)
        if not first <= command.tick <= tick:
            wanted = f"{first} … {tick}" if first < tick else f"{first}"
            self.refused[robot] = f"command.tick: got {command.tick}, expected {wanted}"
            return False
        if (at := _first_beyond(command.row, self._least, self._most)) >= 0:
            name = next(name for name, cut in Command.CUTS.items() if at < cut.stop)
            wanted = f"{self._least[at]:g} … {self._most[at]:g}"
            self.refuse(robot, f"command.{name}: got {command.row[at]:g}, expected {wanted}")
            return False
        self.latest[robot] = command
        self.refused.pop(robot, None)
        return True

    def refuse(self, robot: str, error: str) -> None:
        """Count a command that no process of this project sends; no robot has a newer one."""
        self.invalid[robot] += 1
        self.errors[robot] = self.refused[robot] = error


@compiled
def _first_beyond(row: Array, least: Array, most: Array) -> int:
    """Index of the first number beyond its limits, or that is none; −1 where there is none."""
    for index in range(len(row)):
        if not least[index] <= row[index] <= most[index]:
            return index
    return -1


class CommandTimeout:
    """What one robot's motors follow in real time: its command, or its joints held, until lost.

    Over a link that takes about as long as a command may be old, its age dithers about that limit.
    The motors would change to and fro between holding a posture and torques that belong to another
    one. So they hold until commands have been younger than half the limit for some ticks.

    Args:
        world: the limits.
        first_ms: until then no first command is missed.

    Attributes:
        held: the command that holds the joints; None: the motors follow the robot's.
    """

    def __init__(self, world: WorldConfig, first_ms: int) -> None:
        self._hold_ms, self._lost_ms = world.command_hold_ms, world.command_damp_ms
        self._first_ms = max(first_ms, self._lost_ms)
        self._prompt = self._held_ms = 0
        self.held: Command | None = None

    def choose(
        self,
        command: Command | None,
        tick: int,
        states: Callable[[], Mapping[str, State]],
        robot: str,
    ) -> Command:
        """What the motors follow at a tick.

        Args:
            command: the robot's newest; None before its first.
            tick: the present one.
            states: gives what robots measure at this tick.
            robot: whose command it is.
        """
        age = self._age(command, tick)
        self._prompt = self._prompt + 1 if 2 * age <= self._hold_ms else 0
        follows = age <= self._hold_ms and (self.held is None or self._prompt >= PROMPT_TICKS)
        if command is not None and follows:
            self.held, self._held_ms = None, 0
            return command
        self._held_ms += command is not None
        self.held = self.held or hold_joints(states()[robot])
        return self.held

    def describe_loss(self, command: Command | None, tick: int) -> str:
        """Why a robot's commands count as lost at a tick; "": they do not."""
        age = self._age(command, tick)
        if age > (self._first_ms if command is None else self._lost_ms):
            return f"silent for {age} ms"
        if self._held_ms > max(MOST_HELD_MS, self._lost_ms):
            return f"late for {self._held_ms} ms"
        return ""

    @staticmethod
    def _age(command: Command | None, tick: int) -> int:
        return tick - (-1 if command is None else command.tick)


def hold_joints(state: State) -> Command:
    """The command that holds the joints where they are measured in `state`."""
    zero = np.zeros(N_JOINTS)
    kp, kd = np.full(N_JOINTS, _HOLD_KP), np.full(N_JOINTS, _HOLD_KD)
    return Command(state.tick, state.stamp_ns, zero, state.q_joint, zero, kp, kd)


def damp_joints(tick: int, damping: float = MOTOR_DAMPING) -> Command:
    """The command of a tick that damps all joints, by default as motors without a command do.

    `damping` is in N·m·s/rad.
    """
    zero = np.zeros(N_JOINTS)
    return Command(tick, tick * 1_000_000, zero, zero, zero, zero, np.full(N_JOINTS, damping))
