"""A simulated A1 or Go1 on the network: it reports all the time and obeys the last command."""

from __future__ import annotations

import numpy as np

from quadriga.shared.robot.conventions import N_JOINTS
from quadriga.shared.unitree.packets import OFF, Battery, MotorTargets, PacketError, RobotReport
from quadriga.shared.unitree.udp import UdpCodec
from quadriga.shared.unitree.udp_port import Address, UdpPort
from quadriga.shared.wire.messages import Command, State


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

    def report(self, state: State, heat: np.ndarray[tuple[int], np.dtype[np.float64]]) -> None:
        """Send what the robot measures; `heat` of its motors, (12,), 1 where torque lasts."""
        targets = self._targets
        mode = np.full(N_JOINTS, OFF, np.uint8) if targets is None else targets.mode
        report = RobotReport(
            tick=state.tick,
            quat_wxyz=state.imu_quat_wxyz,
            gyro=state.imu_gyro,
            accel=state.imu_accel,
            q=state.q_joint,
            dq=state.v_joint,
            tau=state.tau_joint,
            foot=state.foot_force,
            mode=mode,
            temperature=30.0 + 40.0 * heat,
            imu_temperature=40,
            battery=Battery(80, -5.0, 24.0),
        )
        self._port.send(self._codec.encode_report(report), self._listener)

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
        targets = self._targets
        if targets is None or (targets.mode == OFF).all():
            return None
        on = (targets.mode != OFF).astype(float)
        # Where nothing is asked for, an angle or a rate is a huge number, with a gain of zero.
        q = np.where(targets.kp > 0.0, targets.q, 0.0)
        dq = np.where(targets.kd > 0.0, targets.dq, 0.0)
        return Command(0, 0, on * targets.tau, q, dq, on * targets.kp, on * targets.kd)

    def close(self) -> None:
        """Leave the network."""
        self._port.close()
