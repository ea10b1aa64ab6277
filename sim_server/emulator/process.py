"""SHELL of the emulated robots: the world, their boards, and what is made to happen to them.

Each line that comes through a pipe as standard input is a command, `ROBOT|all WORD [VALUE]`; what
it does lasts until another one ends it:

    loss, duplicate, reorder or garbage SHARE   of packets, both ways, 0 … 1
    delay MS                                    of packets, both ways
    remote BUTTONS                              are pressed, such as L2+B
    battery PERCENT                             charge
    protect JOINT                               its motor switches itself off, such as FR_calf_joint
    writer                                      somebody else sends damping commands
    clear                                       end all faults
"""

from __future__ import annotations

import os
import select
import sys
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Final, TextIO

import mujoco
import numpy as np

from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError, name_file_errors
from quadriga.shared.messages import Command, Truth
from quadriga.shared.printable import printable_line
from quadriga.shared.robots.conventions import GRAVITY, JOINT_NAMES, Array
from quadriga.shared.runtime.clock import Rate
from quadriga.shared.runtime.scheduling import end_collection, take_priority
from quadriga.shared.runtime.signals import stop_on_signals
from quadriga.shared.unitree.packets import parse_buttons, remote_bytes
from quadriga.sim_server.emulator.board import Board, open_boards
from quadriga.sim_server.world import layout
from quadriga.sim_server.world.world import World

LOST: Final = "behind real time in a second: this computer is too slow"
MOTORS_OFF, DAMPED, DRIVEN = "motors off", "motors damped", "motors driven"
TRUTH_COLUMNS: Final = ("x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wz")
LASTS_MS: Final = 20  # for which motors do something before it is told
HUNG_HEIGHT: Final = 0.6  # m, of a trunk that hangs above the ground
_TICK: Final = 1e-3  # s
_LOOK_MS: Final = 10  # between two looks for commands, and two rows of truth
_SECOND: Final = 1000  # ms
_BRAKING: Final = 3.0  # N·m by which a damping motor's torque may differ from what brakes
_QUICKNESS: Final = 40.0  # rad/s, of a harness; critically damped
_STIFFNESS, _DAMPING = 400.0, 8.0  # N·m/rad, N·m·s/rad of a harness
_STDIN: Final = 0


def run(config: Config, *, hung: bool = False, truth: Path | None = None) -> None:
    """Be the robots until SIGINT or SIGTERM. They lie on the ground at first, or hang.

    Args:
        config: the team's configuration; `bridge.endpoint`, or `bridge.interface`
            and `bridge.domain`, say where each robot is.
        hung: whether they hang in the air.
        truth: gets where they truly are, as CSV every 10 ms: the tick in ms, then `TRUTH_COLUMNS`
            of each robot, world frame, m, m/s and rad/s; None: nothing does.

    Raises:
        ConfigError: an address does not parse or is missing, or the file for the truth cannot be
            written.
        BridgeError: a port is taken, or there is no such interface.
    """
    stopped = stop_on_signals()
    world = World(replace(config, world=replace(config.world, initial_posture="lying")))
    harness = Harness(world) if hung else None
    with ExitStack() as stack:
        log = None
        if truth is not None:
            with name_file_errors(ConfigError, truth, "a file that can be written"):
                log = stack.enter_context(truth.open("w", encoding="utf-8"))
            columns = [f"{name}_{column}" for name in world.names for column in TRUTH_COLUMNS]
            print("ms", *columns, sep=",", file=log)
        boards = open_boards(config)
        for board in boards.values():
            stack.callback(board.close)
        end_collection()
        take_priority(config.runtime.priority)
        _say(f"{len(boards)} simulated {config.robot.title} on the network")
        _serve(world, boards, harness, log, stopped)


def _serve(
    world: World,
    boards: Mapping[str, Board],
    harness: Harness | None,
    log: TextIO | None,
    stopped: Callable[[], bool],
) -> None:
    rate, lost, rest = Rate(_TICK, slack=3.0), 0.0, bytearray()
    commanded = sys.stdin is not None and not sys.stdin.isatty()
    motors = {name: MotorEvents() for name in boards}
    while not stopped():
        if world.tick % _LOOK_MS == 0:
            if log is not None:
                print(world.tick, *truth_row(world.truth()).round(5).tolist(), sep=",", file=log)
            for line in read_lines(_STDIN, rest) if commanded else ():
                _say(f"{world.tick} ms: {execute(line, boards)}")
        states = world.states()
        for k, (name, board) in enumerate(boards.items()):
            board.report(states[name], world.motors.heat[k])
        rate.wait()
        followed = {name: board.obey() for name, board in boards.items()}
        for name, command in followed.items():
            doing = describe_motors(command, states[name].v_joint)
            if (since := motors[name].note(world.tick, doing)) is not None:
                _say(f"{since} ms: {name} {doing}")
        if harness is not None:
            harness.hold()
        world.step({name: c for name, c in followed.items() if c is not None})
        if world.tick % _SECOND == 0 and (ms := round(1000.0 * (rate.lost - lost))):
            lost = rate.lost
            _say(f"{world.tick} ms: {ms} ms {LOST}")
        world.settle()
    _say(f"{world.tick} ms: end, {rate.overruns} ticks began late")


def read_lines(source: int, rest: bytearray) -> list[str]:
    """Whole lines that have come through a pipe; `rest` keeps what has no end yet."""
    if select.select([source], [], [], 0.0)[0]:
        rest += os.read(source, 4096)
    *whole, rest[:] = rest.split(b"\n")
    return [line.decode(errors="replace").strip() for line in whole if line.strip()]


def execute(line: str, boards: Mapping[str, Board]) -> str:
    """Do what a line asks for, see this module; the line, or why it is no command."""
    try:
        name, word, value, *more = [*line.split(), "", ""]
        if name not in ("all", *boards) or any(more):
            raise ValueError(line)
        for board in boards.values() if name == "all" else (boards[name],):
            _execute(board, word, value)
    except (ConfigError, ValueError):
        words = "ROBOT|all and loss, duplicate, reorder, garbage, delay, remote, battery, protect"
        return str(ConfigError("command", repr(line), f"{words}, writer or clear"))
    return line


def _execute(board: Board, word: str, value: str) -> None:
    match word:
        case "loss" | "duplicate" | "reorder" | "garbage" | "delay":
            for link in (board.inwards, board.outwards):
                link.faults = replace(link.faults, **{word: float(value)})
        case "remote":
            board.status.remote = remote_bytes(parse_buttons(value, "command"))
        case "battery":
            board.status.charge = float(value)
        case "protect":
            board.status.protected.add(JOINT_NAMES.index(value))
        case "writer":
            board.add_second_writer()
        case "clear":
            board.clear()
        case _:
            raise ValueError(word)


def describe_motors(command: Command | None, rates: Array) -> str:
    """What the motors do under a command: off, damped or driven.

    They are damped if none is stiff and each gives no more than what brakes its joint: a bridge
    that damps a robot keeps its limits of torque, and takes something off.

    Args:
        command: None: off.
        rates: of the joints, (12,), rad/s.
    """
    if command is None or not (command.kp.any() or command.kd.any() or command.tau.any()):
        return MOTORS_OFF
    braking = command.kd * np.abs(command.v_des - rates) + _BRAKING
    brakes = command.kd.any() and (np.abs(command.tau) <= braking).all()
    return DAMPED if brakes and not command.kp.any() else DRIVEN


class MotorEvents:
    """Tells what one robot's motors do once it has lasted: two writers would fill the screen."""

    def __init__(self) -> None:
        self._told = self._doing = MOTORS_OFF
        self._since = 0  # tick

    def note(self, now: int, doing: str) -> int | None:
        """The tick at which what they do began, if it is to be told now."""
        if doing != self._doing:
            self._doing, self._since = doing, now
        if doing == self._told or now - self._since < LASTS_MS:
            return None
        self._told = doing
        return self._since


class Harness:
    """Holds the trunks of a world's robots in the air: in place, level, heading along x.

    F = m (ω² (p* − p) − 2 ω v + g ẑ);  T = −k ϑ − d w
    """

    def __init__(self, world: World) -> None:
        """Hang the robots, at rest and with their legs as they are."""
        self._physics, self._trunks = world.physics, world.team.trunks
        n = len(world.names)
        self._q = self._physics.qpos[: n * layout.NQ].reshape(n, layout.NQ)
        self._v = self._physics.qvel[: n * layout.NV].reshape(n, layout.NV)
        self._q[:, 2] = HUNG_HEIGHT + world.team.terrain.height(self._q[:, 0], self._q[:, 1])
        self._places = self._q[:, layout.POSITION].copy()
        self._masses = world.team.model.body_subtreemass[self._trunks, None]
        mujoco.mj_forward(world.team.model, self._physics)

    def hold(self) -> None:
        """Apply this tick's forces. Call it before each step of the world."""
        pull = _QUICKNESS**2 * (self._places - self._q[:, layout.POSITION])
        pull -= 2.0 * _QUICKNESS * self._v[:, layout.VELOCITY]
        pull[:, 2] += GRAVITY
        self._physics.xfrc_applied[self._trunks, :3] = self._masses * pull
        turn, rate = np.zeros(3), np.zeros(3)
        for q, v, trunk in zip(self._q, self._v, self._trunks, strict=True):
            mujoco.mju_quat2Vel(turn, q[layout.ATTITUDE], 1.0)
            mujoco.mju_rotVecQuat(rate, v[layout.TRUNK_RATE], q[layout.ATTITUDE])
            self._physics.xfrc_applied[trunk, 3:] = -_STIFFNESS * turn - _DAMPING * rate


def truth_row(truth: Truth) -> Array:
    """The numbers of `TRUTH_COLUMNS` of all robots, one robot after the other, (11 n,)."""
    rate = truth.base_omega[:, 2:]
    return np.hstack([truth.base_pos, truth.base_quat_wxyz, truth.base_vel, rate]).ravel()


def _say(text: str) -> None:
    print(printable_line(text), file=sys.stderr, flush=True)
