"""A simulated Go2 on its network: reports at 500 Hz, commands, and a motion switcher."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from quadriga.shared.robot.conventions import N_JOINTS
from quadriga.shared.unitree import go2, rpc
from quadriga.shared.unitree.dds import DdsParticipant, StructReader, StructWriter
from quadriga.shared.unitree.packets import OFF, ON, MotorTargets
from quadriga.shared.unitree.rpc import RpcEnd, RpcMessage
from quadriga.sim_server.native.board import Board, Intruder
from quadriga.sim_server.native.link import Parcel

_IN_CHARGE: Final = "normal"  # the motion controller that a robot is switched on with
_MOTION_MS: Final = 500  # that it takes to lie down; the answer comes after it


class Go2Robot(Board):
    """One robot's board.

    Its own motion controller writes commands like anybody else while it has the motors, and stays
    an idle writer of them when it has let go.

    Attributes:
        controller: its own motion controller that has the motors; "" if none has.
        lets_go: whether that one lets go of the motors when it is asked to.
        executed: calls that it has answered, each as often as it came.

    Args:
        domain: of its network.
        interface: of this machine.
        seed: of its chance.

    Raises:
        ConfigError: CycloneDDS is not installed.
        BridgeError: the domain cannot be joined.
    """

    period_ms = 2

    def __init__(self, domain: int, interface: str, seed: Sequence[int] = (0,)) -> None:
        super().__init__(go2.GO2, ON, seed, keeps_size=True)
        self._participant = DdsParticipant(domain, interface)
        commands = self._participant.struct_topic(go2.COMMAND_TOPIC, go2.COMMAND_TYPE, go2.COMMAND)
        reports = self._participant.struct_topic(go2.REPORT_TOPIC, go2.REPORT_TYPE, go2.REPORT)
        self._commands = StructReader(
            self._participant, commands, go2.COMMAND.itemsize, of_others=True
        )
        self._own_commands = StructWriter(self._participant, commands, go2.COMMAND.itemsize)
        zero = np.zeros(N_JOINTS)
        modes = np.full(N_JOINTS, OFF, np.uint8)
        self._own_command = go2.GO2.encode_command(MotorTargets(modes, *[zero] * 5))
        self._others = DdsParticipant(domain, interface)  # whoever is on its network, too
        self._reports = StructWriter(self._participant, reports, go2.REPORT.itemsize)
        self._switcher = RpcEnd(self._participant, rpc.MOTION_SWITCHER, serves=True)
        self._sport = RpcEnd(self._participant, rpc.SPORT, serves=True)
        self.controller = _IN_CHARGE
        self.lets_go = True
        self.executed = list[int]()
        self._motions = deque[tuple[int, RpcMessage]]()  # when each is over, tick

    def _send(self, packet: bytes) -> None:
        self._reports.write(packet)

    def _take(self) -> Iterator[Parcel]:
        while (packet := self._commands.take()) is not None:
            yield Parcel(packet)

    def _listens(self) -> bool:
        return not self.controller

    def _serve(self) -> None:
        if self.controller:
            self._own_commands.write(self._own_command)
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
                self._boot()
            else:
                code = rpc.UNKNOWN
            self._switcher.send(RpcMessage(message.id, message.api, text, code))

    def _boot(self) -> None:
        super()._boot()
        self.controller = _IN_CHARGE

    def _open_intruder(self) -> Intruder:
        topic = self._others.struct_topic(go2.COMMAND_TOPIC, go2.COMMAND_TYPE, go2.COMMAND)
        return StructWriter(self._others, topic, go2.COMMAND.itemsize)

    def _close(self) -> None:
        self._others.close()
        self._participant.close()
