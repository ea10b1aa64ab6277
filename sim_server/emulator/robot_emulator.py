"""Emulated robots: from the world's messages to a robot's own packets, and back.

Like a real one an emulated robot has no watchdog: while no packet comes, its motors go on with the
last command.
"""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.messages import Command, State
from quadriga.shared.robots.conventions import N_JOINTS, Array, robot_names
from quadriga.shared.unitree import rpc
from quadriga.shared.unitree.codecs import CODECS, GO2, Codec
from quadriga.shared.unitree.dds import (
    LOW_COMMANDS,
    LOW_STATES,
    DdsParticipant,
    StructReader,
    StructWriter,
)
from quadriga.shared.unitree.packets import (
    NO_ANGLE,
    OFF,
    PROTECTED,
    Battery,
    MotorTargets,
    PacketError,
    RobotReport,
    remote_bytes,
)
from quadriga.shared.unitree.rpc import RpcEnd, RpcMessage
from quadriga.shared.unitree.udp import Address, UdpPort, parse_address
from quadriga.sim_server.emulator.link import NO_FAULTS, Link, Parcel

_STREAM: Final = 11  # of the world's seed
_COUNTER: Final = 1 << 32  # values of a robot's counter
_EMPTY_V, _FULL_V = 21.0, 24.75  # V of an empty battery and of a full one
_CURRENT: Final = -5.0  # A
_COLD, _WARMER = 30.0, 40.0  # °C: of a motor at rest, and of one that gives all that lasts
_IMU_TEMPERATURE: Final = 40  # °C
_DAMPING: Final = 2.0  # N·m·s/rad, that a second writer asks for
_CONTROLLER: Final = "normal"  # the Go2's own, which has the motors when it is switched on
_MOTION_MS: Final = 500  # that it takes to lie down; the answer comes after it
_LOOPBACK: Final = "lo"


@dataclass
class RobotStatus:
    """What a robot reports beside what its world measures.

    Its counter counts milliseconds, as those of Unitree's simulators do, from a number that means
    nothing.
    """

    first: int = 0  # what its counter says at tick 0
    charge: float = 80.0  # of its battery, %
    remote: bytes = remote_bytes()  # what its remote control sends
    protected: set[int] = field(default_factory=set)  # joints whose motors are off by themselves

    def report(self, state: State, heat: Array, targets: MotorTargets | None) -> RobotReport:
        """The report of a tick, with what its sensors measure and what its motors do.

        `heat` is that of the motors, (12,), 1 where continuous torque leads; no targets: off.
        """
        mode = np.full(N_JOINTS, OFF, np.uint8) if targets is None else targets.mode.copy()
        mode[list(self.protected)] = PROTECTED
        volts = _EMPTY_V + (_FULL_V - _EMPTY_V) * self.charge / 100.0
        return RobotReport(
            tick=(self.first + state.tick) % _COUNTER,
            quat_wxyz=state.imu_quat_wxyz,
            gyro=state.imu_gyro,
            accel=state.imu_accel,
            q=state.q_joint,
            dq=state.v_joint,
            tau=state.tau_joint,
            foot=state.foot_force,
            mode=mode,
            temperature=_COLD + _WARMER * heat,
            imu_temperature=_IMU_TEMPERATURE,
            remote=self.remote,
            battery=Battery(int(self.charge), _CURRENT, volts),
        )

    def command(self, targets: MotorTargets | None) -> Command | None:
        """What the world's motors do under a robot's command; None if all are off, and brake."""
        if targets is None or not (targets.mode != OFF).any():
            return None
        on = (targets.mode != OFF).astype(float)
        on[list(self.protected)] = 0.0
        # Where nothing is asked for, an angle or a rate is a huge number, with a gain of zero.
        q = np.where(targets.kp > 0.0, targets.q, 0.0)
        dq = np.where(targets.kd > 0.0, targets.dq, 0.0)
        return Command(0, 0, on * targets.tau, q, dq, on * targets.kp, on * targets.kd)


class RobotEmulator(ABC):
    """What emulated robots of all kinds do alike.

    Attributes:
        period_ms: between two reports.
        controller: its own motion controller that has the motors; "" if none has.
        status: of the robot.
        inwards, outwards: the ways of commands and of reports through its network.
        malformed, received: packets that were no commands, and commands.
    """

    period_ms: int
    controller: str = ""

    def __init__(self, codec: Codec, seed: Sequence[int]) -> None:
        self._codec = codec
        self.inwards, self.outwards = Link((*seed, 0)), Link((*seed, 1))
        self._chance = np.random.default_rng((*seed, 2))
        self._first = int(self._chance.integers(_COUNTER))
        self.status = RobotStatus(self._first)
        self._targets: MotorTargets | None = None
        self._listener: tuple[str, int] | None = None
        self._second_writer: UdpPort | StructWriter | None = None
        self._now = 0  # ms
        self.malformed = self.received = 0

    def report(self, state: State, heat: Array) -> None:
        """Send what is due at a tick: what the robot measures, at its rate; see `RobotStatus`."""
        self._now, parcels = state.tick, list[Parcel]()
        if state.tick % self.period_ms == 0:
            report = self.status.report(state, heat, self._targets)
            parcels = [Parcel(self._codec.encode_report(report))]
        for parcel in self.outwards.pass_on(parcels, self._now):
            self._send(parcel.packet)

    def obey(self) -> Command | None:
        """The command that the motors follow now; None: they are off, and brake."""
        if self._second_writer is not None and self._chance.integers(2):
            modes, zero = np.full(N_JOINTS, self._codec.servo, np.uint8), np.zeros(N_JOINTS)
            damp = MotorTargets(modes, zero + NO_ANGLE, zero, zero, zero, zero + _DAMPING)
            self._second_writer.send(self._codec.encode_command(damp))
        for parcel in self.inwards.pass_on(tuple(self._take()), self._now):
            try:
                targets = self._codec.decode_command(parcel.packet)
            except PacketError:
                self.malformed += 1
                continue
            self.received += 1
            self._listener = parcel.sender or self._listener
            self._targets = self._targets if self.controller else targets
        return self.status.command(self._targets)

    def add_second_writer(self) -> None:
        """Have somebody else damp the motors, in half of all milliseconds.

        Raises:
            BridgeError: there is no port for it.
        """
        self._second_writer = self._second_writer or self._open_writer()

    def clear(self) -> None:
        """End all faults."""
        self.inwards.faults = self.outwards.faults = NO_FAULTS
        self.status = RobotStatus(self._first)
        if self._second_writer is not None:
            self._second_writer.close()
            self._second_writer = None

    def close(self) -> None:
        """Leave the network."""
        self.clear()

    @abstractmethod
    def _send(self, packet: bytes) -> None:
        """Put a report on the network."""

    @abstractmethod
    def _take(self) -> Iterable[Parcel]:
        """What has come from the network, oldest first."""

    @abstractmethod
    def _open_writer(self) -> UdpPort | StructWriter:
        """How somebody else writes commands."""


class UdpEmulator(RobotEmulator):
    """An A1 or Go1 at an address: it reports to who commanded it last, and to nobody before.

    Raises:
        BridgeError: the port is taken.
    """

    period_ms = 1

    def __init__(self, codec: Codec, here: Address, seed: Sequence[int] = (0,)) -> None:
        super().__init__(codec, seed)
        self._here, self._port = here, UdpPort(here)

    def _send(self, packet: bytes) -> None:
        self._port.send(packet, self._listener and Address(*self._listener))

    def _take(self) -> Iterator[Parcel]:
        return (Parcel(packet, sender) for packet, sender in self._port.drain())

    def _open_writer(self) -> UdpPort:
        return UdpPort(Address(self._here.host, 0), self._here)

    def close(self) -> None:
        """Leave the network."""
        super().close()
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

    def __init__(self, domain: int, interface: str, seed: Sequence[int] = (0,)) -> None:
        super().__init__(GO2, seed)
        self._participant = DdsParticipant(domain, interface)
        self._commands = StructReader(self._participant, LOW_COMMANDS, of_others=True)
        self._own_commands = StructWriter(self._participant, LOW_COMMANDS)
        self._reports = StructWriter(self._participant, LOW_STATES)
        modes, zero = np.full(N_JOINTS, OFF, np.uint8), np.zeros(N_JOINTS)
        self._own_command = GO2.encode_command(MotorTargets(modes, *[zero] * 5))
        self._others = DdsParticipant(domain, interface)  # whoever is on its network, too
        self._switcher = RpcEnd(self._participant, rpc.MOTION_SWITCHER, serves=True)
        self._sport = RpcEnd(self._participant, rpc.SPORT, serves=True)
        self.controller, self.lets_go = _CONTROLLER, True
        self.executed = list[int]()
        self._motions = deque[tuple[int, RpcMessage]]()  # when each is over, tick

    def report(self, state: State, heat: Array) -> None:
        """See `RobotEmulator`; it also answers what its services have been asked."""
        super().report(state, heat)
        if state.tick % self.period_ms == 0:
            self._serve()

    def _send(self, packet: bytes) -> None:
        self._reports.send(packet)

    def _take(self) -> Iterator[Parcel]:
        while (packet := self._commands.take()) is not None:
            yield Parcel(packet)

    def _serve(self) -> None:
        if self.controller:
            self._own_commands.send(self._own_command)
        for message in self._sport.receive():
            after = self._motions[-1][0] if self._motions else self._now
            takes = _MOTION_MS if message.api == rpc.STAND_DOWN else 0
            self._motions.append((after + takes, message))
        while self._motions and self._motions[0][0] <= self._now:
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

    def _open_writer(self) -> StructWriter:
        return StructWriter(self._others, LOW_COMMANDS)

    def close(self) -> None:
        """Leave the network."""
        super().close()
        self._others.close()
        self._participant.close()


def open_emulators(config: Config) -> dict[str, RobotEmulator]:
    """The emulated robots by name, each on a network of its own.

    Raises:
        ConfigError: an address does not parse or is missing.
        BridgeError: a port is taken, or there is no such interface.
    """
    team, bridge, opened = config.team, config.bridge, dict[str, RobotEmulator]()
    with ExitStack() as stack:
        for index, name in enumerate(robot_names(team.robots)):
            seed, number = (config.world.seed, _STREAM, index), str(index + 1)
            if team.robot == "go2":
                interface = (bridge.interface or _LOOPBACK).replace("{number}", number)
                # Robots on one loopback, which real ones are not, have domains of their own.
                domain = bridge.domain + index * (interface == _LOOPBACK)
                opened[name] = Go2Emulator(domain, interface, seed)
            else:
                text = bridge.endpoint.replace("{number}", number)
                here = parse_address(text, "bridge.endpoint", Address("", 0))
                if not here.port:
                    cause = (
                        "an emulated robot is not at the address of a real one: deploy/desk.toml"
                    )
                    raise ConfigError("bridge.endpoint", "nothing", "HOST:PORT", cause)
                opened[name] = UdpEmulator(CODECS[team.robot], here, seed)
            stack.callback(opened[name].close)
        stack.pop_all()
    return opened
