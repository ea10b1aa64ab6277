"""What all simulated boards do alike: from the world's messages to packets, and back."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from quadriga.shared.robot.conventions import Array
from quadriga.shared.unitree.packets import OFF, Battery, MotorTargets, RobotReport
from quadriga.shared.wire.messages import Command, State

_COLD, _WARMER = 30.0, 40.0  # °C: of a motor at rest, and of one that gives all that lasts
_BATTERY = Battery(80, -5.0, 24.0)


class Board(Protocol):
    """A simulated robot on its network.

    Attributes:
        period_ms: between two reports.
    """

    period_ms: int

    def report(self, state: State, heat: Array) -> None:
        """Send what the robot measures; `heat` of its motors, (12,), 1 where torque lasts."""
        ...

    def obey(self) -> Command | None:
        """The command that the motors follow now; None: they are off, and brake."""
        ...

    def close(self) -> None:
        """Leave the network."""
        ...


def to_report(state: State, heat: Array, mode: NDArray[np.uint8]) -> RobotReport:
    """What a robot says of a tick.

    Args:
        state: what its sensors measure.
        heat: of the motors, (12,), 1 where continuous torque leads.
        mode: of the motors, (12,).
    """
    return RobotReport(
        tick=state.tick,
        quat_wxyz=state.imu_quat_wxyz,
        gyro=state.imu_gyro,
        accel=state.imu_accel,
        q=state.q_joint,
        dq=state.v_joint,
        tau=state.tau_joint,
        foot=state.foot_force,
        mode=mode,
        temperature=_COLD + _WARMER * heat,
        imu_temperature=40,
        battery=_BATTERY,
    )


def to_command(targets: MotorTargets | None) -> Command | None:
    """What the world's motors do under a robot's command; None if all are off."""
    if targets is None or (targets.mode == OFF).all():
        return None
    on = (targets.mode != OFF).astype(float)
    # Where nothing is asked for, an angle or a rate is a huge number, with a gain of zero.
    q = np.where(targets.kp > 0.0, targets.q, 0.0)
    dq = np.where(targets.kd > 0.0, targets.dq, 0.0)
    return Command(0, 0, on * targets.tau, q, dq, on * targets.kp, on * targets.kd)
