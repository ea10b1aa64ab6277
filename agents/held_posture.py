"""Standing without knowing one's attitude: the joints are led to the stand, and held there."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from quadriga.agents.imu_bridge import ImuState
from quadriga.plant.late import hold_joints
from quadriga.shared.robot.conventions import Array
from quadriga.shared.robot.spec import RobotSpec
from quadriga.shared.wire.messages import Command, State

_LEAD_MS: Final = 200.0  # from where the joints are to the stand: a swinging foot is soon down

_STILL: Final = State(0, 0, *(np.zeros(cut.stop - cut.start) for cut in State.CUTS.values()))
_HOLD: Final = hold_joints(_STILL).row  # gains alone


def hold_or_release(imu: ImuState, state: State, *, stands: bool) -> ImuState:
    """Begin to hold a robot that stands while its attitude is missing, and only then.

    Args:
        imu: what is known of the IMU, and what is held already.
        state: what the robot measures now.
        stands: whether it is to.
    """
    if not (stands and imu.missing_ms):
        return imu if imu.held is None else replace(imu, held=None)
    if imu.held is not None:
        return imu
    return replace(imu, held=np.concatenate([[state.tick], state.q_joint]))


def held_row(held: Array, tick: int, robot: RobotSpec) -> Array:
    """The row of the command at a tick, (60,).

    Args:
        held: since which tick, and where the joints were then, rad, (13,).
        tick: the present one.
        robot: how it stands.
    """
    share = min(1.0, (tick - held[0]) / _LEAD_MS)
    smooth = share * share * (3.0 - 2.0 * share)
    row: Array = _HOLD.copy()
    row[Command.CUTS["q_des"]] = held[1:] + smooth * (robot.q_stand - held[1:])
    return row
