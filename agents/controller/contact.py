"""From scheduled stance and foot force to the contacts the QP may push on, and the ground height.

With contact detection on, a swing foot that is loaded in the second half of swing becomes a
stance foot early, and a stance foot without load for `lost_contact_ms` is taken out of the
contact set and descends until it finds ground.
"""

from __future__ import annotations

import numpy as np

from shared.jit import compiled
from shared.robot import FOOT_RADIUS, Array

_EARLIEST_TOUCHDOWN = 0.5  # of swing: before this a load is the foot still leaving the ground


@compiled
def contacts_by_schedule(
    ground0: Array, level0: float, stance: Array, foot_z: Array, rate: float
) -> tuple[Array, float]:
    """The paper's plain setting: contacts are the schedule's, the ground is flat and known.

    Arguments and results as of `contacts_by_force`.
    """
    legs = np.zeros((5, 4))
    total, count = 0.0, 0
    for leg in range(4):
        legs[0, leg] = legs[3, leg] = stance[leg]
        legs[4, leg] = ground0[leg]
        if stance[leg] > 0.5:
            legs[4, leg] = foot_z[leg] - FOOT_RADIUS
            total += legs[4, leg]
            count += 1
    return legs, level0 + rate * (total / count - level0)


@compiled
def contacts_by_force(
    legs0: Array, level0: float, switched: bool, stance: Array, progress: float, foot_force: Array,
    foot_z: Array, threshold: float, patience: float, rate: float, dt: float,
) -> tuple[Array, float]:  # fmt: skip
    """Update the contacts of one robot.

    Args:
        legs0: at the last tick, (5, 4), of each leg: 1 where the QP may push (contact); 1 where
            the foot landed before its stance began (early); time without force during stance, s
            (unloaded); 1 where the ground has been felt in this stance (latched); height of the
            ground felt last, m, odometry frame (ground).
        level0: filtered height of the ground under the stance feet, m.
        switched: whether stances and swings have just ended.
        stance: scheduled stance, (4,), 1 or 0.
        progress: progress of the half period in [0, 1).
        foot_force: measured normal forces, (4,), N.
        foot_z: heights of the foot centres, (4,), m, odometry frame.
        threshold: force from which on a foot is loaded, N.
        patience: time without load after which a stance foot is no contact, s.
        rate: share of a tick in the filter of the ground's height.
        dt: time since the last tick, s.

    Returns:
        The new legs and level.
    """
    legs = legs0.copy()
    contact, early, unloaded, latched, ground = legs
    total, count = 0.0, 0
    for leg in range(4):
        loaded = foot_force[leg] >= threshold
        if switched:
            if stance[leg] < 0.5:
                latched[leg] = 0.0
            early[leg] = 0.0
            unloaded[leg] = 0.0
        if stance[leg] > 0.5:
            unloaded[leg] = 0.0 if loaded else unloaded[leg] + dt
            contact[leg] = 1.0 if unloaded[leg] <= patience else 0.0
        else:
            if loaded and progress > _EARLIEST_TOUCHDOWN:
                early[leg] = 1.0
            contact[leg] = early[leg]
        # The ground is where the foot first bore load: latching at the scheduled touchdown
        # would take the height of a foot still in the air, and ratchet upward.
        if contact[leg] > 0.5 and loaded and latched[leg] < 0.5:
            latched[leg] = 1.0
            ground[leg] = foot_z[leg] - FOOT_RADIUS
        if contact[leg] > 0.5 and latched[leg] > 0.5:
            # The estimator's height drifts; a standing foot carries its ground along with it.
            ground[leg] += rate * (foot_z[leg] - FOOT_RADIUS - ground[leg])
            if stance[leg] > 0.5:
                total += ground[leg]
                count += 1
    level = level0
    if count > 0:
        level += rate * (total / count - level0)
    return legs, level
