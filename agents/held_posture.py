"""Standing by the joints alone, without an attitude or a joint's angle: led to a posture, and held.

The motors lead their joints to the stand and hold them there. One whose encoder is not believed
cannot be led: its motor gives the torque that bears its share of the weight in the stand, more
where the leg's corner of the trunk sinks below the trunk's centre, less where it rises. Without
that the leg would slowly fold, or stretch, as a knee bears the more the straighter it is.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.agents.controller.maths.leg_reaction import foot_forces
from quadriga.agents.modes import STAND, Mode
from quadriga.agents.sensor_loss import SensorLoss
from quadriga.plant.late import hold_joints
from quadriga.shared.robot.conventions import GRAVITY, N_JOINTS, N_LEGS, Array
from quadriga.shared.robot.spec import RobotSpec
from quadriga.shared.wire.messages import Command, State

_LEAD_MS: Final = 200.0  # from where the joints are to the stand: a swinging foot is soon down

_SUNK: Final = 0.04  # m, of a corner, at which its leg bears twice its share
_SINKS: Final = 0.3  # m/s, likewise
_MOST: Final = 2.0  # shares

_STILL: Final = State(0, 0, *(np.zeros(cut.stop - cut.start) for cut in State.CUTS.values()))
_HOLD: Final = hold_joints(_STILL).row  # gains alone
_CUT: Final = Command.CUTS


class HeldPosture:
    """Fixed data of a robot's posture.

    Args:
        robot: its kind.
    """

    def __init__(self, robot: RobotSpec) -> None:
        self._stand = robot.q_stand
        self._bears = _standing_torques(robot)
        self._corners = robot.feet_under_hips

    def step(
        self, held: Array | None, mode: Mode, state: State, loss: SensorLoss
    ) -> tuple[Array | None, Array | None]:
        """Begin to hold a robot that stands without knowing enough, go on, or release it.

        Args:
            held: since which tick, and where its joints were then, rad, (13,); None: it is not.
            mode: the present one.
            state: what is believed now.
            loss: what the robot does not know.

        Returns:
            The new `held`, and the row of the command, (60,); both None if it is not to be held.
        """
        if not loss.now or mode.name != STAND:
            return None, None
        held = np.concatenate([[state.tick], state.q_joint]) if held is None else held
        share = min(1.0, (state.tick - held[0]) / _LEAD_MS)
        smooth = share * share * (3.0 - 2.0 * share)
        row: Array = _HOLD.copy()
        row[_CUT["q_des"]] = held[1:] + smooth * (self._stand - held[1:])
        for joint in loss.joints:
            share = _share(self._corners[joint // 3], state)
            row[_CUT["tau"]][joint] = share * self._bears[joint]
            row[_CUT["kp"]][joint] = row[_CUT["kd"]][joint] = 0.0
        return held, row


def _share(corner: Array, state: State) -> float:
    """What the leg of a corner of the trunk is to bear, in shares of a quarter of the weight.

    Args:
        corner: where it is, x and y, in the trunk's frame, m.
        state: the trunk's attitude and rates.
    """
    (w, i, j, k), (x, y) = state.imu_quat_wxyz, corner
    height = 2.0 * (i * k - w * j) * x + 2.0 * (j * k + w * i) * y  # above the trunk's centre
    rate = state.imu_gyro[0] * y - state.imu_gyro[1] * x
    return float(min(max(1.0 - height / _SUNK - rate / _SINKS, 0.0), _MOST))


def _standing_torques(robot: RobotSpec) -> Array:
    """Of the motors of a robot that stands on four feet, legs without a mass, (12,), N·m."""
    weight = np.array([0.0, 0.0, GRAVITY * robot.geometry.mass / N_LEGS])
    torques = np.zeros(N_JOINTS)
    for leg in range(N_LEGS):
        joints = slice(3 * leg, 3 * leg + 3)
        forces = np.empty((3, 3))  # of a unit torque of each joint
        for joint in range(3):
            unit = np.zeros(N_JOINTS)
            unit[3 * leg + joint] = -1.0
            forces[:, joint] = foot_forces(unit, robot.q_stand, robot.geometry)[leg]
        torques[joints] = np.linalg.solve(forces, weight)
    return torques
