"""How bridges reach their robots: UDP packets of A1 and Go1, and structs over DDS of the Go2."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections import Counter
from typing import Any, Final

import numpy as np

from quadriga.bridges.postures import passive
from quadriga.shared.config.sections import BridgeConfig
from quadriga.shared.errors import BridgeError, ConfigError
from quadriga.shared.robots.conventions import N_JOINTS
from quadriga.shared.runtime.clock import monotonic, monotonic_ns, sleep
from quadriga.shared.unitree import rpc
from quadriga.shared.unitree.codecs import CODECS, GO2, Codec
from quadriga.shared.unitree.dds import (
    LOW_COMMANDS,
    LOW_STATES,
    DdsParticipant,
    StructReader,
    StructWriter,
)
from quadriga.shared.unitree.packets import ON, SERVO, MotorTargets, PacketError, RobotReport
from quadriga.shared.unitree.rpc import RpcEnd, RpcMessage
from quadriga.shared.unitree.udp import Address, UdpPort, parse_address

_ROBOT: Final = Address("192.168.123.10", 8007)
_LISTEN: Final = {"a1": Address("", 8080), "go1": Address("", 8090)}
_HALF: Final = 1 << 31  # of the counter's range: a tick is behind another if it is less than this
_ANSWER: Final = 4.0  # s, for the robot to be found and to answer a query
_LETTING_GO: Final = 15.0  # s, for its controller to do what it is asked to
_LOOK: Final = 0.01  # s
_AGAIN: Final = 0.5  # s, between two queries
_WATCHED: Final = 0.3  # s, for which nobody else may write commands
_STILL_S, _STILL = 1.0, 0.2  # s for which joints are slower, rad/s, when a robot has lain down


class RobotDriver(ABC):
    """One robot on its own network.

    Attributes:
        servo: the motors' mode in which they follow commands.
        packets_ms: between two packets of the robot.
        period_ms: between two of its states that are used, and two commands.
        counters: packets by what became of them; "received" those that are good and new.
        malformed: what was wrong with the last packet that was no report; "" before the first.
        released: the robot's own controller that was asked to let go of the motors; "" if none.
    """

    servo: int
    packets_ms: int

    def __init__(self, period_ms: int = 0) -> None:
        """With another period than that of the robot's packets, if one is given."""
        self.period_ms = period_ms or self.packets_ms
        self.malformed = self.released = ""
        self.counters: Counter[str] = Counter()

    @abstractmethod
    def receive(self) -> RobotReport | None:
        """The newest report that has come since the last call; None if there is none."""

    def introduce(self) -> None:
        """Send one packet that enables no motor, if the robot reports to none but who sent one."""
        return

    @abstractmethod
    def send(self, targets: MotorTargets) -> None:
        """Send a command. A packet that cannot be sent is counted, not an error."""

    def other_writers(self) -> int:
        """How many others have commanded the motors since the last call, as far as is known."""
        return 0

    def take_over(self) -> None:
        """Have the robot's own controller let go of the motors, if they have one to be asked.

        Raises:
            BridgeError: it does not.
        """
        return

    @abstractmethod
    def close(self) -> None:
        """Leave the robot's network."""

    def _read(self, codec: Codec, packet: bytes) -> RobotReport | None:
        """The report of a packet; what is damaged is counted, by its reason too."""
        try:
            return codec.decode_report(packet)
        except PacketError as error:
            self.counters.update(("malformed", f"malformed_{error.reason}"))
            self.malformed = str(error)
            return None


class UdpDriver(RobotDriver):
    """An A1 or Go1. Who else sends to the robot cannot be known over UDP.

    With `sends_only` it only ever sends, from any port.

    Raises:
        ConfigError: an address does not parse or resolve.
        BridgeError: the port is taken, or the address is not of this machine.
    """

    servo, packets_ms = SERVO, 1

    def __init__(self, kind: str, config: BridgeConfig, *, sends_only: bool = False) -> None:
        super().__init__(config.period_ms)
        robot = parse_address(config.endpoint, "bridge.endpoint", _ROBOT)
        listen = parse_address(config.listen, "bridge.listen", _LISTEN[kind])
        self._codec: Codec = CODECS[kind]
        self._port = UdpPort(Address(listen.host, 0) if sends_only else listen, robot)
        self._tick: int | None = None

    def receive(self) -> RobotReport | None:
        """The newest report; damaged, foreign, repeated and older ones are counted."""
        newest = None
        for packet, _ in self._port.drain():
            report = self._read(self._codec, packet)
            if report is not None and self._is_newer(report.tick):
                newest = report
                self.counters["received"] += 1
        return newest

    def _is_newer(self, tick: int) -> bool:
        ahead = 1 if self._tick is None else (tick - self._tick) & 0xFFFFFFFF
        if ahead == 0:
            self.counters["repeated"] += 1
            return False
        if ahead >= _HALF:
            self.counters["older"] += 1
            return False
        self._tick = tick
        return True

    def introduce(self) -> None:
        """See `RobotDriver`: these robots may learn from it where to send reports."""
        self.send(passive(np.zeros(N_JOINTS)))

    def send(self, targets: MotorTargets) -> None:
        """See `RobotDriver`."""
        sent = self._port.send(self._codec.encode_command(targets))
        self.counters["sent" if sent else "unsent"] += 1

    def close(self) -> None:
        """See `RobotDriver`."""
        self._port.close()


class Go2Driver(RobotDriver):
    """A Go2. With `sends_only` it only ever sends, and has the right to from the start.

    Raises:
        ConfigError: no interface is given, or CycloneDDS is not installed.
        BridgeError: the domain cannot be joined.
    """

    servo, packets_ms = ON, 2

    def __init__(self, config: BridgeConfig, *, sends_only: bool = False) -> None:
        if not config.interface:
            expected = "the one the robot hangs on, e.g. eth0"
            raise ConfigError("bridge.interface", "nothing", expected)
        super().__init__(config.period_ms)
        self._participant = DdsParticipant(config.domain, config.interface)
        self._reports = StructReader(self._participant, LOW_STATES)
        # Healthy robots have writers of commands that never write: what they write is counted.
        self._witness = StructReader(self._participant, LOW_COMMANDS, of_others=True)
        self._commands: StructWriter | None = None
        if sends_only:
            self._commands = StructWriter(self._participant, LOW_COMMANDS)
        self._switcher = RpcEnd(self._participant, rpc.MOTION_SWITCHER, serves=False)
        self._sport = RpcEnd(self._participant, rpc.SPORT, serves=False)

    def receive(self) -> RobotReport | None:
        """The newest report; what is damaged is counted."""
        newest = None
        while (packet := self._reports.take()) is not None:
            if (report := self._read(GO2, packet)) is not None:
                newest = report
                self.counters["received"] += 1
        return newest

    def send(self, targets: MotorTargets) -> None:
        """See `RobotDriver`. There is no writer of commands before `take_over`."""
        sent = self._commands is not None and self._commands.send(GO2.encode_command(targets))
        self.counters["sent" if sent else "unsent"] += 1

    def other_writers(self) -> int:
        """See `RobotDriver`."""
        return len(self._writers())

    def _writers(self) -> set[int]:
        """Who has written commands since the last call."""
        writers = set[int]()
        while self._witness.take() is not None:
            writers.add(self._witness.writer)
        return writers

    def give_back(self, controller: str) -> None:
        """Have one of the robot's own controllers take the motors, until it says that it has.

        Args:
            controller: its name, as `released` had it.

        Raises:
            BridgeError: it does not.
        """
        self._call(self._switcher, rpc.SELECT_MODE, {"name": controller}, _LETTING_GO)
        self._await_mode(controller)

    def take_over(self) -> None:
        """Ask the motion controller to lie down and let go, until the robot says that it has.

        Raises:
            BridgeError: it does not answer, lie down or let go, or someone else writes commands.
                It may have let go if `released` names it.
        """
        name = self._motion_mode()
        self._refuse_writers(name)
        if name:
            self._lie_down(name)
            self.released = name
            self._call(self._switcher, rpc.RELEASE_MODE, {}, _LETTING_GO)
            self._await_mode("")
            sleep(_WATCHED)  # for its last commands
            self.other_writers()
            self._refuse_writers("")
        self._commands = StructWriter(self._participant, LOW_COMMANDS)

    def _refuse_writers(self, controller: str) -> None:
        """Look whether anybody writes commands but the robot's own controller, if it has one."""
        seen, deadline = set[int](), monotonic() + _WATCHED
        while monotonic() < deadline:
            seen |= self._writers()
            sleep(_LOOK)
        if len(seen) > bool(controller):
            got = f"{len(seen)} others who write it"
            expected = f"its own controller {controller!r} alone" if controller else "nobody else"
            raise BridgeError("rt/lowcmd", got, expected, "another bridge, or an app?")

    def _lie_down(self, controller: str) -> None:
        """Have the robot's own controller lie down, and wait until it lies."""
        self._call(self._sport, rpc.STAND_DOWN, {}, _LETTING_GO)
        begun = still = monotonic()
        while (now := monotonic()) - still < _STILL_S:
            report = self.receive()
            if report is not None and not np.abs(report.dq).max() < _STILL:
                still = now
            if now - begun > _LETTING_GO:
                what = f"the robot's own controller {controller!r}"
                cause = "switch it off in the app"
                raise BridgeError(what, "joints that move", "to lie down", cause)
            sleep(_LOOK)

    def _await_mode(self, controller: str) -> None:
        """Wait until this controller is in charge, or none if it is ""."""
        deadline = monotonic() + _LETTING_GO
        while (name := self._motion_mode()) != controller:
            if monotonic() > deadline:
                expected = f"{controller!r}, which it is asked for" if controller else "to let go"
                cause = "" if controller else "switch it off in the app; is the firmware old?"
                raise BridgeError("the robot's own controller", repr(name), expected, cause)
            sleep(_AGAIN)

    def _motion_mode(self) -> str:
        """Name of the controller that is in charge; "" if none is."""
        answer = self._call(self._switcher, rpc.CHECK_MODE, {}, _ANSWER, is_query=True)
        try:
            return str(json.loads(answer.text)["name"])
        except (ValueError, KeyError, TypeError):
            what, got = "the robot's motion switcher", f"code {answer.code}, {answer.text!r}"
            raise BridgeError(what, got, "the name of a controller", "firmware?") from None

    def _call(
        self,
        service: RpcEnd,
        api: int,
        parameters: dict[str, Any],
        seconds: float,
        *,
        is_query: bool = False,
    ) -> RpcMessage:
        """The response to a call; an error if there is none, or a refusal of what is no query.

        The robot does what it is asked as often as it is asked. So it is asked once, after it has
        answered a query: it may not have found this side yet. Queries alone are repeated.
        """
        if not is_query:
            self._call(service, rpc.API_VERSION, {}, _ANSWER, is_query=True)
        begun, asked, number = monotonic(), 0.0, monotonic_ns()
        while (now := monotonic()) - begun < seconds:
            if service.is_linked and (not asked or (is_query and now - asked > _AGAIN)):
                service.send(RpcMessage(number, api, json.dumps(parameters)))
                asked = now
            for message in service.receive():
                if message.id != number:
                    continue
                if message.code == rpc.OK or is_query:
                    return message
                what, got = f"the robot's {service.service}", f"code {message.code}"
                raise BridgeError(what, got, f"to do what call {api} asks for")
            sleep(_LOOK)
        got = f"no answer in {seconds:g} s" if asked else f"nobody there in {seconds:g} s"
        what, cause = f"the robot's {service.service}", "is it a Go2 EDU? is the firmware old?"
        raise BridgeError(what, got, f"an answer to call {api}", cause)

    def close(self) -> None:
        """Leave the network, and have the robot know it."""
        self._participant.close()


def open_driver(kind: str, config: BridgeConfig, *, sends_only: bool = False) -> RobotDriver:
    """Open the way to an "a1", "go1" or "go2"; the watchdog's only ever sends.

    Raises:
        ConfigError: no interface, or an address that does not parse.
        BridgeError: the way cannot be opened.
    """
    if kind == "go2":
        return Go2Driver(config, sends_only=sends_only)
    return UdpDriver(kind, config, sends_only=sends_only)
