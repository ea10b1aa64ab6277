"""SHELL of the simulated robots behind their own protocols: A1 and Go1 over UDP, the Go2 over DDS.

Like a real one such a robot has no watchdog: while no packet comes, its motors go on with the last
command.
"""

from __future__ import annotations

import json
import sys
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from typing import Final

import mujoco
import numpy as np

from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.messages import Command, State
from quadriga.shared.printable import printable_line
from quadriga.shared.robots.conventions import GRAVITY, N_JOINTS, Array, robot_names
from quadriga.shared.runtime.clock import Rate
from quadriga.shared.runtime.scheduling import end_collection, take_priority
from quadriga.shared.runtime.signals import stop_on_signals
from quadriga.shared.unitree import rpc
from quadriga.shared.unitree.codecs import CODECS, GO2, Codec
from quadriga.shared.unitree.dds import (
    LOW_COMMANDS,
    LOW_STATES,
    DdsParticipant,
    StructReader,
    StructWriter,
)
from quadriga.shared.unitree.packets import OFF, Battery, MotorTargets, PacketError, RobotReport
from quadriga.shared.unitree.rpc import RpcEnd, RpcMessage
from quadriga.shared.unitree.udp import Address, UdpPort, parse_address
from quadriga.sim_server.world import layout
from quadriga.sim_server.world.world import World

MOTORS_OFF, DAMPED, DRIVEN = "motors off", "motors damped", "motors driven"
LASTS_MS: Final = 20  # for which motors do something before it is told: two writers alternate
HUNG_HEIGHT: Final = 0.6  # m, of a trunk that hangs above the ground
_COUNTER: Final = 1 << 32  # values of a robot's counter of milliseconds
_FIRST: Final = _COUNTER - 20_000  # its value at tick 0, which means nothing: it wraps soon
_COLD, _WARMER = 30.0, 40.0  # °C: of a motor at rest, and of one that gives all that lasts
_BATTERY: Final = Battery(80, -5.0, 24.0)
_BRAKING: Final = 3.0  # N·m by which a damping motor's torque may differ from what brakes
_CONTROLLER: Final = "normal"  # the Go2's own, which has the motors when it is switched on
_MOTION_MS: Final = 500  # that it takes to lie down; the answer comes after it
_SECOND: Final = 1000  # ms


def report_of(state: State, heat: Array, targets: MotorTargets | None) -> RobotReport:
    """The report of a robot whose sensors measure this; `heat` is that of its motors, (12,)."""
    return RobotReport(
        tick=(_FIRST + state.tick) % _COUNTER,
        quat_wxyz=state.imu_quat_wxyz,
        gyro=state.imu_gyro,
        accel=state.imu_accel,
        q=state.q_joint,
        dq=state.v_joint,
        tau=state.tau_joint,
        foot=state.foot_force,
        mode=np.full(N_JOINTS, OFF, np.uint8) if targets is None else targets.mode,
        temperature=_COLD + _WARMER * heat,
        battery=_BATTERY,
    )


def command_of(targets: MotorTargets | None) -> Command | None:
    """What the world's motors do under a robot's command; None if all are off, and brake."""
    if targets is None or not (targets.mode != OFF).any():
        return None
    on = (targets.mode != OFF).astype(float)
    # Where nothing is asked for, an angle or a rate is a huge number, with a gain of zero.
    q = np.where(targets.kp > 0.0, targets.q, 0.0)
    dq = np.where(targets.kd > 0.0, targets.dq, 0.0)
    return Command(0, 0, on * targets.tau, q, dq, on * targets.kp, on * targets.kd)


class RobotEmulator(ABC):
    """What emulated robots of all kinds do alike.

    Attributes:
        period_ms: between two reports.
        controller: its own motion controller that has the motors; "" if none has.
        malformed, received: packets that were no commands, and commands.
    """

    period_ms: int
    controller: str = ""

    def __init__(self, codec: Codec) -> None:
        self._codec = codec
        self._targets: MotorTargets | None = None
        self.malformed = self.received = 0

    def report(self, state: State, heat: Array) -> None:
        """Send what is due at a tick: what the robot measures, at its rate; see `report_of`."""
        if state.tick % self.period_ms == 0:
            self._send(self._codec.encode_report(report_of(state, heat, self._targets)))

    def obey(self) -> Command | None:
        """The command that the motors follow now; None: they are off, and brake."""
        for packet in self._take():
            try:
                targets = self._codec.decode_command(packet)
            except PacketError:
                self.malformed += 1
                continue
            self.received += 1
            self._targets = self._targets if self.controller else targets
        return command_of(self._targets)

    @abstractmethod
    def _send(self, packet: bytes) -> None:
        """Put a report on the network."""

    @abstractmethod
    def _take(self) -> Iterable[bytes]:
        """What has come from the network, oldest first."""

    @abstractmethod
    def close(self) -> None:
        """Leave the network."""


class UdpEmulator(RobotEmulator):
    """An A1 or Go1 at an address: it reports to who sent to it last, and to nobody before.

    Raises:
        BridgeError: the port is taken.
    """

    period_ms = 1

    def __init__(self, codec: Codec, here: Address) -> None:
        super().__init__(codec)
        self._port = UdpPort(here)
        self._listener: Address | None = None

    def _send(self, packet: bytes) -> None:
        self._port.send(packet, self._listener)

    def _take(self) -> Iterator[bytes]:
        for packet, sender in self._port.drain():
            self._listener = sender
            yield packet

    def close(self) -> None:
        """Leave the network."""
        self._port.close()


class Go2Emulator(RobotEmulator):
    """A Go2: reports at 500 Hz, commands, its motion switcher and its service `sport`.

    Its own motion controller writes commands like anybody else while it has the motors, and stays
    an idle writer of them when it has let go.

    Attributes:
        lets_go: whether its controller lets go of the motors when it is asked to.
        executed: calls that it has answered, each as often as it came.

    Raises:
        ConfigError: CycloneDDS is not installed.
        BridgeError: the domain cannot be joined.
    """

    period_ms = 2

    def __init__(self, domain: int, interface: str) -> None:
        super().__init__(GO2)
        self._participant = DdsParticipant(domain, interface)
        self._commands = StructReader(self._participant, LOW_COMMANDS, of_others=True)
        self._own_commands = StructWriter(self._participant, LOW_COMMANDS)
        self._reports = StructWriter(self._participant, LOW_STATES)
        modes, zero = np.full(N_JOINTS, OFF, np.uint8), np.zeros(N_JOINTS)
        self._own_command = GO2.encode_command(MotorTargets(modes, *[zero] * 5))
        self._switcher = RpcEnd(self._participant, rpc.MOTION_SWITCHER, serves=True)
        self._sport = RpcEnd(self._participant, rpc.SPORT, serves=True)
        self.controller, self.lets_go = _CONTROLLER, True
        self.executed = list[int]()
        self._motions = deque[tuple[int, RpcMessage]]()  # when each is over, tick

    def report(self, state: State, heat: Array) -> None:
        """See `RobotEmulator`; it also answers what its services have been asked."""
        super().report(state, heat)
        if state.tick % self.period_ms == 0:
            self._serve(state.tick)

    def _send(self, packet: bytes) -> None:
        self._reports.send(packet)

    def _take(self) -> Iterator[bytes]:
        while (packet := self._commands.take()) is not None:
            yield packet

    def _serve(self, now: int) -> None:
        if self.controller:
            self._own_commands.send(self._own_command)
        for message in self._sport.receive():
            after = self._motions[-1][0] if self._motions else now
            takes = _MOTION_MS if message.api == rpc.STAND_DOWN else 0
            self._motions.append((after + takes, message))
        while self._motions and self._motions[0][0] <= now:
            _, message = self._motions.popleft()
            self.executed.append(message.api)
            self._sport.send(message._replace(text="", code=rpc.OK))
        for message in self._switcher.receive():
            self.executed.append(message.api)
            text, code = "", rpc.OK
            if message.api == rpc.CHECK_MODE:
                text = json.dumps({"form": "0", "name": self.controller})
            elif message.api == rpc.RELEASE_MODE:
                self.controller = "" if self.lets_go else self.controller
            elif message.api == rpc.SELECT_MODE:
                self._targets, self.controller = None, _CONTROLLER
            else:
                code = rpc.UNKNOWN
            self._switcher.send(message._replace(text=text, code=code))

    def close(self) -> None:
        """Leave the network."""
        self._participant.close()


def open_emulators(config: Config) -> dict[str, RobotEmulator]:
    """The emulated robots by name, each on a network of its own.

    Raises:
        ConfigError: an address does not parse or is missing.
        BridgeError: a port is taken, or there is no such interface.
    """
    kind, opened = config.team.robot, dict[str, RobotEmulator]()
    team = replace(config.bridge, interface=config.bridge.interface or "lo")
    with ExitStack() as stack:
        for name in robot_names(config.team.robots):
            bridge = team.of_robot(name)
            if kind == "go2":
                opened[name] = Go2Emulator(bridge.domain, bridge.interface)
            else:
                here = parse_address(bridge.endpoint, "bridge.endpoint", Address("", 0))
                if not here.port:
                    cause = (
                        "an emulated robot is not at the address of a real one: deploy/desk.toml"
                    )
                    raise ConfigError("bridge.endpoint", "nothing", "HOST:PORT", cause)
                opened[name] = UdpEmulator(CODECS[kind], here)
            stack.callback(opened[name].close)
        stack.pop_all()
    return opened


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


def run(config: Config, *, hung: bool = False) -> None:
    """Be the robots until SIGINT or SIGTERM. They lie on the ground at first, or hang.

    `bridge.endpoint`, or `bridge.interface` and `bridge.domain`, say where each robot is.

    Raises:
        ConfigError: an address does not parse or is missing.
        BridgeError: a port is taken, or there is no such interface.
    """
    stopped = stop_on_signals()
    world = World(replace(config, world=replace(config.world, initial_posture="lying")))
    harness = Harness(world) if hung else None
    with ExitStack() as stack:
        emulators = open_emulators(config)
        for emulator in emulators.values():
            stack.callback(emulator.close)
        end_collection()
        take_priority(config.runtime.priority)
        _log(f"{len(emulators)} simulated {config.robot.title} on the network")
        rate, lost = Rate(1e-3, slack=3.0), 0.0
        events = {name: MotorEvents() for name in emulators}
        while not stopped():
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
                behind = "behind real time in a second: this computer is too slow"
                _log(f"{world.tick} ms: {ms} ms {behind}")
            world.settle()
        _log(f"{world.tick} ms: end, {rate.overruns} ticks began late")


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


def _log(text: str) -> None:
    print(printable_line(text), file=sys.stderr, flush=True)
