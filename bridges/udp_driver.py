"""A1 and Go1: packets over UDP, newest first, old ones noticed."""

from __future__ import annotations

from collections import Counter
from typing import Final

import numpy as np

from quadriga.bridges.driver import count_malformed
from quadriga.bridges.postures import passive
from quadriga.shared.config.bridge import BridgeConfig
from quadriga.shared.robot.conventions import N_JOINTS
from quadriga.shared.unitree.packets import SERVO, MotorTargets, PacketError, RobotReport
from quadriga.shared.unitree.udp import CODECS, UdpCodec
from quadriga.shared.unitree.udp_port import Address, UdpPort, parse_address

_ROBOT: Final = Address("192.168.123.10", 8007)
_LISTEN: Final = {"a1": Address("", 8080), "go1": Address("", 8090)}
_HALF: Final = 1 << 31  # of the counter's range: a tick is behind another if it is less than this
_RESTARTED: Final = 100  # reports in a row with older ticks: the robot has been started again


class UdpDriver:
    """See `RobotDriver`. Who else sends to the robot cannot be known over UDP.

    Args:
        kind: "a1" or "go1".
        config: where the robot is, and where its packets arrive.
        guards: whether it only ever sends, from any port.

    Raises:
        ConfigError: an address does not parse or resolve.
        BridgeError: the port is taken, or the address is not of this machine.
    """

    servo, packets_ms = SERVO, 1

    def __init__(self, kind: str, config: BridgeConfig, *, guards: bool = False) -> None:
        robot = parse_address(config.endpoint, "bridge.endpoint", _ROBOT)
        listen = parse_address(config.listen, "bridge.listen", _LISTEN[kind])
        self._codec: UdpCodec = CODECS[kind]
        self._port = UdpPort(Address(listen.host, 0) if guards else listen, robot)
        self._tick: int | None = None
        self._older = 0
        self.period_ms = config.period_ms or self.packets_ms
        self.malformed = self.released = ""
        self.counters: Counter[str] = Counter()

    def receive(self) -> RobotReport | None:
        """The newest report; damaged, foreign, repeated and older ones are counted."""
        newest = None
        for packet, _ in self._port.drain():
            try:
                report = self._codec.decode_report(packet)
            except PacketError as error:
                self.malformed = count_malformed(self.counters, error)
                continue
            if self._is_newer(report.tick):
                newest = report
                self.counters["received"] += 1
        return newest

    def _is_newer(self, tick: int) -> bool:
        if self._tick is not None:
            ahead = (tick - self._tick) & 0xFFFFFFFF
            if ahead == 0:
                self.counters["repeated"] += 1
                return False
            if ahead >= _HALF:
                self.counters["older"] += 1
                self._older += 1
                if self._older < _RESTARTED:
                    return False
        self._tick, self._older = tick, 0
        return True

    def introduce(self) -> None:
        """See `RobotDriver`: these robots may learn from it where to send reports."""
        self.send(passive(np.zeros(N_JOINTS)))

    def send(self, targets: MotorTargets) -> None:
        """See `RobotDriver`."""
        sent = self._port.send(self._codec.encode_command(targets))
        self.counters["sent" if sent else "unsent"] += 1

    def other_writers(self) -> int:
        """Always 0: nobody tells."""
        return 0

    def take_over(self) -> None:
        """Nothing to do: the operator has put the robot into its low-level mode."""

    def close(self) -> None:
        """See `RobotDriver`."""
        self._port.close()
