"""Joint rates of a robot whose trunk moves over feet that do not."""

from __future__ import annotations

import numpy as np

from quadriga.shared.robot.conventions import Array
from tests.a1 import leg_kinematics


def rates_over_still_feet(q_joint: Array, velocity: Array, omega: Array) -> Array:
    """Joint rates, (12,), of a trunk that moves so over feet that do not: J v = −(v₀ + ω × p)."""
    place, _, _ = leg_kinematics(q_joint, np.zeros(12))
    rates = np.empty(12)
    for leg in range(4):
        columns = []
        for joint in range(3 * leg, 3 * leg + 3):
            _, foot, _ = leg_kinematics(q_joint, np.eye(12)[joint])
            columns.append(foot[leg])
        asked = -(velocity + np.cross(omega, place[leg]))
        rates[3 * leg : 3 * leg + 3] = np.linalg.solve(np.stack(columns, axis=1), asked)
    return rates
