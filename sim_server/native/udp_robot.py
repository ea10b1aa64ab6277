"""A simulated A1 or Go1 on the network: it reports all the time and obeys the last command."""

from __future__ import annotations

import numpy as np

from quadriga.shared.robot.conventions import N_JOINTS, Array
from quadriga.shared.unitree.packets import OFF, MotorTargets, PacketError
from quadriga.shared.unitree.udp import UdpCodec
from quadriga.shared.unitree.udp_port import Address, UdpPort
from quadriga.shared.wire.messages import Command, State
from quadriga.sim_server.native.board import to_command, to_report


class UdpRobot:
    """One robot's board.

    Like a real one it has no watchdog: while no packet comes, its motors go on with the last one.

    Args:
        codec: of its packets.
        here: where it takes commands.
        listener: where it sends reports until somebody commands it.

    Raises:
        BridgeError: the port is taken.
    """

    period_ms = 1

    def __init__(self, codec: UdpCodec, here: Address, listener: Address) -> None:
        self._codec, self._port, self._listener = codec, UdpPort(here), listener
        self._targets: MotorTargets | None = None
        self.malformed = 0
        self.received = 0

    def report(self, state: State, heat: Array) -> None:
        """Send what the robot measures; `heat` of its motors, (12,), 1 where torque lasts."""
        mode = np.full(N_JOINTS, OFF, np.uint8) if self._targets is None else self._targets.mode
        packet = self._codec.encode_report(to_report(state, heat, mode))
        self._port.send(packet, self._listener)

    def obey(self) -> Command | None:
        """The command that the motors follow now; None: they are off, and brake."""
        for packet, sender in self._port.drain():
            try:
                self._targets = self._codec.decode_command(packet)
            except PacketError:
                self.malformed += 1
                continue
            self._listener = sender
            self.received += 1
        return to_command(self._targets)

    def close(self) -> None:
        """Leave the network."""
        self._port.close()
