"""When a robot knows too little of itself to walk on: it stands at once, by its joints alone.

Yokes keep a robot level, and one that stands is dragged along by those that walk on: so a yoked one
walks on for longer than one that is alone.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.agents.encoder_bridge import ENCODERS, joints_held, name_joints
from quadriga.agents.modes import ENCODER_LOST, IMU_LOST
from quadriga.shared.robot.conventions import JOINT_NAMES, Array
from quadriga.shared.runtime.record import record
from quadriga.shared.wire.codes import with_detail

_ALONE_MS: Final = 100.0
_YOKED_IMU_MS: Final = 600.0
# By the kind of joint: on a thigh that is held a leg swings to where it should not be.
_YOKED_ENCODER_MS: Final = {"hip": 800.0, "thigh": 300.0, "calf": 800.0}


@record
class SensorLoss:
    """What a robot does not know of itself.

    Attributes:
        reason: why it can walk no more; "": it can.
        joints: those whose angle is not known at the moment, of 0 … 11.
        now: whether anything is unknown that it must know to stand by feedback, or to walk again.
    """

    reason: str
    joints: tuple[int, ...]
    now: bool


_NOTHING: Final = SensorLoss("", (), now=False)


class SensorLosses:
    """How long a robot can do without one of its sensors.

    Args:
        yoked: whether it is yoked to others.
    """

    def __init__(self, *, yoked: bool) -> None:
        self._imu_ms = _YOKED_IMU_MS if yoked else _ALONE_MS
        kinds = (name.split("_")[1] for name in JOINT_NAMES)
        limits = [_YOKED_ENCODER_MS[kind] if yoked else _ALONE_MS for kind in kinds]
        self._encoder_ms = np.array(limits)

    def find(self, missing_ms: float, encoders: Array) -> SensorLoss:
        """What is lost at a tick.

        Args:
            missing_ms: for how long no attitude has been believed.
            encoders: what is remembered of them, see `EncoderLayout`.
        """
        if not (missing_ms or encoders[ENCODERS.longest]):
            return _NOTHING
        lost, reason = joints_held(encoders, self._encoder_ms), ""
        if missing_ms > self._imu_ms:
            reason = IMU_LOST
        elif lost:
            reason = with_detail(ENCODER_LOST, name_joints(lost))
        return SensorLoss(reason, joints_held(encoders, 0.0), bool(lost) or missing_ms > 0)
