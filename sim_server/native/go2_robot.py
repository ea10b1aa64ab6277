"""A simulated Go2 on its network: reports at 500 Hz, commands, and a motion switcher."""

from __future__ import annotations

import json

import numpy as np

from quadriga.shared.robot.conventions import N_JOINTS, Array
from quadriga.shared.unitree import go2, rpc
from quadriga.shared.unitree.dds import DdsParticipant, StructReader, StructWriter
from quadriga.shared.unitree.packets import OFF, MotorTargets, PacketError
from quadriga.shared.unitree.rpc import RpcEnd, RpcMessage
from quadriga.shared.wire.messages import Command, State
from quadriga.sim_server.native.board import to_command, to_report

_IN_CHARGE = "normal"  # the motion controller that a robot is switched on with


class Go2Robot:
    """One robot's board. Like a real one it goes on with the last command while none comes.

    Args:
        domain: of its network.
        interface: of this machine.

    Raises:
        ConfigError: CycloneDDS is not installed.
        BridgeError: the domain cannot be joined.
    """

    period_ms = 2
    lets_go = True  # of the motors, when its motion controller is asked to

    def __init__(self, domain: int, interface: str) -> None:
        self._participant = DdsParticipant(domain, interface)
        commands = self._participant.struct_topic(go2.COMMAND_TOPIC, go2.COMMAND_TYPE, go2.COMMAND)
        reports = self._participant.struct_topic(go2.REPORT_TOPIC, go2.REPORT_TYPE, go2.REPORT)
        self._commands = StructReader(self._participant, commands, go2.COMMAND.itemsize)
        self._reports = StructWriter(self._participant, reports, go2.REPORT.itemsize)
        self._switcher = RpcEnd(self._participant, rpc.MOTION_SWITCHER, serves=True)
        self._sport = RpcEnd(self._participant, rpc.SPORT, serves=True)
        self._targets: MotorTargets | None = None
        self.controller = _IN_CHARGE
        self.malformed = 0
        self.received = 0

    def report(self, state: State, heat: Array) -> None:
        """Send what the robot measures; `heat` of its motors, (12,), 1 where torque lasts."""
        mode = np.full(N_JOINTS, OFF, np.uint8) if self._targets is None else self._targets.mode
        self._reports.write(go2.GO2.encode_report(to_report(state, heat, mode)))
        self._answer_calls()

    def obey(self) -> Command | None:
        """The command that the motors follow now; None: they are off, and brake."""
        while (packet := self._commands.take()) is not None:
            try:
                targets = go2.GO2.decode_command(packet)
            except PacketError:
                self.malformed += 1
                continue
            self.received += 1
            if not self.controller:  # else its own controller has the motors
                self._targets = targets
        return to_command(self._targets)

    def _answer_calls(self) -> None:
        for message in self._sport.receive():
            self._sport.send(message._replace(text="", code=rpc.OK))
        for message in self._switcher.receive():
            text, code = "", rpc.OK
            if message.api == rpc.CHECK_MODE:
                text = json.dumps({"form": "0", "name": self.controller})
            elif message.api == rpc.RELEASE_MODE:
                self.controller = "" if self.lets_go else self.controller
            elif message.api == rpc.SELECT_MODE:
                self.controller, self._targets = _IN_CHARGE, None
            else:
                code = rpc.UNKNOWN
            self._switcher.send(RpcMessage(message.id, message.api, text, code))

    def close(self) -> None:
        """Leave the network."""
        self._participant.close()
