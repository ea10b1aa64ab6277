"""Go2: structs over DDS, once the robot's own motion controller has been asked to let go."""

from __future__ import annotations

import json
from collections import Counter
from typing import Any, Final

from quadriga.shared.config.bridge import BridgeConfig
from quadriga.shared.errors import BridgeError, ConfigError
from quadriga.shared.runtime.clock import monotonic, monotonic_ns, sleep
from quadriga.shared.unitree import go2, rpc
from quadriga.shared.unitree.dds import DdsParticipant, StructReader, StructWriter
from quadriga.shared.unitree.packets import ON, MotorTargets, PacketError, RobotReport
from quadriga.shared.unitree.rpc import RpcEnd, RpcMessage

_ANSWER: Final = 2.0  # s, for the robot to answer a call
_LETTING_GO: Final = 15.0  # s, for its controller to let go of the motors
_LOOK: Final = 0.01  # s
_FOUND: Final = 2.0  # s, for two sides of a service to find each other


class Go2Driver:
    """See `RobotDriver`.

    Args:
        config: interface and domain.
        guards: whether it only ever sends, and has the right to from the start.

    Raises:
        ConfigError: no interface is given, or CycloneDDS is not installed.
        BridgeError: the domain cannot be joined.
    """

    servo, packets_ms = ON, 2

    def __init__(self, config: BridgeConfig, *, guards: bool = False) -> None:
        if not config.interface:
            raise ConfigError(
                "bridge.interface", "nothing", "the one the robot hangs on, e.g. eth0"
            )
        self._participant = DdsParticipant(config.domain, config.interface)
        commands = self._participant.struct_topic(go2.COMMAND_TOPIC, go2.COMMAND_TYPE, go2.COMMAND)
        reports = self._participant.struct_topic(go2.REPORT_TOPIC, go2.REPORT_TYPE, go2.REPORT)
        self._reports = StructReader(self._participant, reports, go2.REPORT.itemsize)
        # It reads nothing; the library tells it of everybody who writes commands.
        self._witness = StructReader(self._participant, commands, go2.COMMAND.itemsize)
        self._commands_topic = commands
        self._commands: StructWriter | None = None
        self.period_ms = config.period_ms or self.packets_ms
        self.own_guards, self.released = 0, ""
        if guards:
            self._open_commands()
        self._switcher = RpcEnd(self._participant, rpc.MOTION_SWITCHER, serves=False)
        self._sport = RpcEnd(self._participant, rpc.SPORT, serves=False)
        self.counters: Counter[str] = Counter()

    def receive(self) -> RobotReport | None:
        """The newest report; what is damaged is counted."""
        newest = None
        while (packet := self._reports.take()) is not None:
            try:
                newest = go2.GO2.decode_report(packet)
            except PacketError:
                self.counters["malformed"] += 1
                continue
            self.counters["received"] += 1
        return newest

    def send(self, targets: MotorTargets) -> None:
        """See `RobotDriver`. There is no writer of commands before `take_over`."""
        sent = self._commands is not None and self._commands.write(go2.GO2.encode_command(targets))
        self.counters["sent" if sent else "unsent"] += 1

    def other_writers(self) -> int:
        """How many others write commands, but for this bridge's guard."""
        own = self.own_guards + (self._commands is not None)
        return max(0, self._participant.writers_seen_by(self._witness.handle) - own)

    def give_back(self, controller: str) -> None:
        """Have one of the robot's own controllers take the motors, until it says that it has.

        Args:
            controller: its name, as `released` had it.

        Raises:
            BridgeError: it does not.
        """
        self._call(self._switcher, rpc.SELECT_MODE, {"name": controller})
        deadline = monotonic() + _LETTING_GO
        while (name := self._motion_mode()) != controller:
            if monotonic() > deadline:
                expected = f"{controller!r}, which it is asked for"
                raise BridgeError("the robot's own controller", repr(name), expected)
            sleep(0.5)

    def take_over(self) -> None:
        """Ask the motion controller to lie down and let go, until the robot says that it has.

        Raises:
            BridgeError: it does not answer or does not let go, or someone else writes commands.
        """
        deadline = monotonic() + _LETTING_GO
        while name := self._motion_mode():
            if monotonic() > deadline:
                cause = "switch it off in the app; is the firmware old?"
                raise BridgeError("the robot's own controller", name, "to let go", cause)
            self.released = name
            self._call(self._sport, rpc.STAND_DOWN, {})
            self._call(self._switcher, rpc.RELEASE_MODE, {})
            sleep(0.5)
        if others := self.other_writers():
            cause = "its own controller, or another bridge on the same network"
            raise BridgeError("rt/lowcmd", f"{others} others who write it", "nobody else", cause)
        self._open_commands()

    def _open_commands(self) -> None:
        self._commands = StructWriter(self._participant, self._commands_topic, go2.COMMAND.itemsize)

    def _motion_mode(self) -> str:
        """Name of the controller that is in charge; "" if none is.

        Raises:
            BridgeError: no answer, or none that can be read.
        """
        answer = self._call(self._switcher, rpc.CHECK_MODE, {})
        what = "the robot's motion switcher"
        if answer is None:
            raise BridgeError(what, f"no answer in {_ANSWER:g} s", "an answer", "is it a Go2 EDU?")
        try:
            return str(json.loads(answer.text)["name"])
        except (ValueError, KeyError, TypeError):
            got = f"code {answer.code}, {answer.text!r}"
            raise BridgeError(what, got, "the name of a controller", "firmware?") from None

    def _call(self, service: RpcEnd, api: int, parameters: dict[str, Any]) -> RpcMessage | None:
        """The response to a call, which is repeated until both sides are linked; None: too late."""
        begun, asked = monotonic(), -1.0
        number = monotonic_ns()
        while (passed := monotonic() - begun) < _FOUND + _ANSWER:
            if passed - asked > 0.5:
                service.send(RpcMessage(number, api, json.dumps(parameters)))
                asked = passed
            for message in service.receive():
                if message.id == number:
                    return message
            sleep(_LOOK)
        return None

    def close(self) -> None:
        """Leave the network, and have the robot know it."""
        self._participant.close()
