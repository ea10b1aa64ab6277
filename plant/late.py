"""What a motor does when its robot's command is late: use it, hold the joints, damp them."""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.shared.config.sections import WorldConfig
from quadriga.shared.robot.conventions import N_JOINTS
from quadriga.shared.wire.messages import Command, State

FRESH: Final = "fresh"
HOLD: Final = "hold"
DAMP: Final = "damp"

_HOLD_KP: Final = 80.0  # N·m/rad, carries a standing robot
_HOLD_KD: Final = 3.0  # N·m·s/rad


def grade(age_ms: int, world: WorldConfig) -> str:
    """Which of the three applies to a command of this age."""
    if age_ms <= world.command_hold_ms:
        return FRESH
    return HOLD if age_ms <= world.command_damp_ms else DAMP


def hold_joints(state: State) -> Command:
    """The command that holds the joints where they are measured in `state`."""
    zero = np.zeros(N_JOINTS)
    kp, kd = np.full(N_JOINTS, _HOLD_KP), np.full(N_JOINTS, _HOLD_KD)
    return Command(state.tick, state.stamp_ns, zero, state.q_joint, zero, kp, kd)
