"""SHELL of the emulated robots: the world, their emulators, and what is made to happen to them.

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
from quadriga.sim_server.emulator.robot_emulator import RobotEmulator, open_emulators
from quadriga.sim_server.world import layout
from quadriga.sim_server.world.world import World

LOST: Final = "behind real time in a second: this computer is too slow"
MOTORS_OFF, DAMPED, DRIVEN = "motors off", "motors damped", "motors driven"
TRUTH_COLUMNS: Final = ("x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wz")
LASTS_MS: Final = 20  # for which motors do something before it is an event: two writers alternate
HUNG_HEIGHT: Final = 0.6  # m, of a trunk that hangs above the ground
_TICK: Final = 1e-3  # s
_POLL_MS: Final = 10  # between two polls for commands, and two rows of truth
_SECOND: Final = 1000  # ms
_BRAKING: Final = 3.0  # N·m by which a damping motor's torque may differ from what brakes
_STDIN: Final = 0
_WORDS: Final = (
    "ROBOT|all and loss, duplicate, reorder, garbage, delay, remote, battery, protect, writer or "
    "clear"
)


def run(config: Config, *, hung: bool = False, truth: Path | None = None) -> None:
    """Be the robots until SIGINT or SIGTERM. They lie on the ground at first, or hang.

    `bridge.endpoint`, or `bridge.interface` and `bridge.domain`, say where each robot is. The file
    `truth` gets where they truly are, as CSV every 10 ms: the tick in ms, then `TRUTH_COLUMNS` of
    each robot, world frame, m, m/s and rad/s.

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
        emulators = open_emulators(config)
        for emulator in emulators.values():
            stack.callback(emulator.close)
        end_collection()
        take_priority(config.runtime.priority)
        _log(f"{len(emulators)} simulated {config.robot.title} on the network")
        _serve(world, emulators, harness, log, stopped)


def _serve(
    world: World,
    emulators: Mapping[str, RobotEmulator],
    harness: Harness | None,
    truth: TextIO | None,
    stopped: Callable[[], bool],
) -> None:
    rate, lost, rest = Rate(_TICK, slack=3.0), 0.0, bytearray()
    commanded = sys.stdin is not None and not sys.stdin.isatty()
    events = {name: MotorEvents() for name in emulators}
    while not stopped():
        if world.tick % _POLL_MS == 0:
            if truth is not None:
                print(world.tick, *truth_row(world.truth()).round(5).tolist(), sep=",", file=truth)
            for line in read_lines(_STDIN, rest) if commanded else ():
                _log(f"{world.tick} ms: {execute(line, emulators)}")
        states = world.states()
        for k, (name, emulator) in enumerate(emulators.items()):
            emulator.report(states[name], world.motors.heat[k])
        rate.wait()
        commands = dict[str, Command]()
        for name, emulator in emulators.items():
            if (command := emulator.obey()) is not None:
                commands[name] = command
            doing = describe_motors(command, states[name].v_joint)
            if (since := events[name].update(world.tick, doing)) is not None:
                _log(f"{since} ms: {name} {doing}")
        world.step(commands)
        if harness is not None:
            harness.hold()
        if world.tick % _SECOND == 0 and (ms := round(1000.0 * (rate.lost - lost))):
            lost = rate.lost
            _log(f"{world.tick} ms: {ms} ms {LOST}")
        world.settle()
    _log(f"{world.tick} ms: end, {rate.overruns} ticks began late")


def read_lines(source: int, rest: bytearray) -> list[str]:
    """Whole lines that have come through a pipe; `rest` keeps what has no end yet."""
    if select.select([source], [], [], 0.0)[0]:
        rest += os.read(source, 4096)
    *whole, rest[:] = rest.split(b"\n")
    return [line.decode(errors="replace").strip() for line in whole if line.strip()]


def execute(line: str, emulators: Mapping[str, RobotEmulator]) -> str:
    """Do what a line asks for, see this module; the line, or why it is no command."""
    try:
        name, word, value, *more = [*line.split(), "", ""]
        if name not in ("all", *emulators) or any(more):
            raise ValueError(line)
        for emulator in emulators.values() if name == "all" else (emulators[name],):
            _dispatch(emulator, word, value)
    except (ConfigError, ValueError):
        return str(ConfigError("command", repr(line), _WORDS))
    return line


def _dispatch(emulator: RobotEmulator, word: str, value: str) -> None:
    match word:
        case "loss" | "duplicate" | "reorder" | "garbage" | "delay":
            for link in (emulator.inwards, emulator.outwards):
                link.faults = replace(link.faults, **{word: float(value)})
        case "remote":
            emulator.status.remote = remote_bytes(parse_buttons(value, "command"))
        case "battery":
            emulator.status.charge = float(value)
        case "protect":
            emulator.status.protected.add(JOINT_NAMES.index(value))
        case "writer":
            emulator.add_second_writer()
        case "clear":
            emulator.clear()
        case _:
            raise ValueError(word)


def describe_motors(command: Command | None, rates: Array) -> str:
    """What the motors do under a command, None if they are off: they are off, damped or driven.

    They are damped if none is stiff and each gives no more than what brakes its joint at its rate,
    (12,), rad/s: a bridge that damps a robot keeps its limits of torque, and takes something off.
    """
    if command is None or not (command.kp.any() or command.kd.any() or command.tau.any()):
        return MOTORS_OFF
    braking = command.kd * np.abs(command.v_des - rates) + _BRAKING
    brakes = command.kd.any() and (np.abs(command.tau) <= braking).all()
    return DAMPED if brakes and not command.kp.any() else DRIVEN


class MotorEvents:
    """When one robot's motors begin to do something that lasts."""

    def __init__(self) -> None:
        self._known = self._doing = MOTORS_OFF
        self._since = 0  # tick

    def update(self, now: int, doing: str) -> int | None:
        """The tick at which what they do began, at the tick at which it has lasted."""
        if doing != self._doing:
            self._doing, self._since = doing, now
        if doing == self._known or now - self._since < LASTS_MS:
            return None
        self._known = doing
        return self._since


class Harness:
    """Holds the trunks of a world's robots in the air: in place, level, heading along x."""

    def __init__(self, world: World) -> None:
        """Hang the robots, at rest and with their legs as they are."""
        physics, model, n = world.physics, world.team.model, len(world.names)
        self._q = physics.qpos[: n * layout.NQ].reshape(n, layout.NQ)
        self._v = physics.qvel[: n * layout.NV].reshape(n, layout.NV)
        self._q[:, 2] = HUNG_HEIGHT + world.team.terrain.height(self._q[:, 0], self._q[:, 1])
        self._places = self._q[:, layout.POSE].copy()
        # What carries them: without it accelerometers would feel a free fall in each tick.
        physics.xfrc_applied[world.team.trunks, 2] = (
            GRAVITY * model.body_subtreemass[world.team.trunks]
        )
        mujoco.mj_forward(model, physics)

    def hold(self) -> None:
        """Put the trunks back. Call it after each step of the world."""
        self._q[:, layout.POSE] = self._places
        self._v[:, : layout.JOINT_RATES.start] = 0.0


def truth_row(truth: Truth) -> Array:
    """The numbers of `TRUTH_COLUMNS` of all robots, one robot after the other, (11 n,)."""
    rate = truth.base_omega[:, 2:]
    return np.hstack([truth.base_pos, truth.base_quat_wxyz, truth.base_vel, rate]).ravel()


def _log(text: str) -> None:
    print(printable_line(text), file=sys.stderr, flush=True)
