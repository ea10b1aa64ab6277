"""From scheduled stance and foot force to the contacts the QP may push on, and the ground height.

With contact detection on, a swing foot that is loaded in the second half of swing becomes a
stance foot early, and a stance foot without load for `lost_contact_ms` is taken out of the
contact set and descends until it finds ground.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shared.config import ControllerConfig
from shared.jit import compiled
from shared.robot import FOOT_RADIUS, Array

_EARLIEST_TOUCHDOWN = 0.5  # of swing: before this a load is the foot still leaving the ground


@dataclass(frozen=True, slots=True)
class ContactState:
    """What is remembered of each leg.

    Attributes:
        contact: 1 where the QP may push, (4,).
        early: 1 where the foot landed before its stance began, (4,).
        unloaded: time without force during stance, (4,), s.
        latched: 1 where the ground has been felt in this stance, (4,).
        ground: height of the ground felt last under each foot, (4,), m, odometry frame.
        level: filtered height of the ground under the stance feet, m.
        half: number of the half period, to notice a switch.
    """

    contact: Array
    early: Array
    unloaded: Array
    latched: Array
    ground: Array
    level: float
    half: int


def initial_contact() -> ContactState:
    """All four feet on flat ground at height zero."""
    return ContactState(
        np.ones(4), np.zeros(4), np.zeros(4), np.ones(4), np.zeros(4), 0.0, -1
    )  # fmt: skip


def step_contact(
    previous: ContactState, config: ControllerConfig, stance: Array, progress: float, half: int,
    foot_force: Array, foot_z: Array, dt: float,
) -> ContactState:  # fmt: skip
    """Update the contacts of one robot.

    Args:
        previous: the contacts at the last tick.
        config: the controller's section.
        stance: scheduled stance, (4,), 1 or 0.
        progress: progress of the half period in [0, 1).
        half: its number; a change ends stances and swings.
        foot_force: measured normal forces, (4,), N.
        foot_z: heights of the foot centres, (4,), m, odometry frame.
        dt: time since the last tick, s.
    """
    rate = dt / (1e-3 * config.ground_filter_ms + dt)
    if not config.contact_detection:
        return _scheduled_contact(previous, stance, half, foot_z, rate)
    legs, level = _step(
        previous.contact, previous.early, previous.unloaded, previous.latched, previous.ground,
        previous.level, half != previous.half, stance, progress, foot_force, foot_z,
        config.contact_force, 1e-3 * config.lost_contact_ms, rate, dt,
    )  # fmt: skip
    contact, early, unloaded, latched, ground = legs
    return ContactState(contact, early, unloaded, latched, ground, level, half)


def _scheduled_contact(
    previous: ContactState, stance: Array, half: int, foot_z: Array, rate: float
) -> ContactState:
    """The paper's plain setting: contacts are the schedule's, the ground is flat and known."""
    ground = np.where(stance > 0.5, foot_z - FOOT_RADIUS, previous.ground)
    level = previous.level + rate * (float(ground[stance > 0.5].mean()) - previous.level)
    return ContactState(
        stance.copy(), np.zeros(4), np.zeros(4), stance.copy(), ground, level, half
    )  # fmt: skip


@compiled
def _step(
    contact0: Array, early0: Array, unloaded0: Array, latched0: Array, ground0: Array,
    level0: float, switched: bool, stance: Array, progress: float, foot_force: Array,
    foot_z: Array, threshold: float, patience: float, rate: float, dt: float,
) -> tuple[Array, float]:  # fmt: skip
    """The new contact, early, unloaded, latched, ground as rows of (5, 4), and the level."""
    legs = np.empty((5, 4))
    contact, early, unloaded, latched, ground = legs
    contact[:], early[:], unloaded[:] = contact0, early0, unloaded0
    latched[:], ground[:] = latched0, ground0
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
