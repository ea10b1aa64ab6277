"""From scheduled stance and foot force to the contacts the QP may push on, and the ground height.

With contact detection on, a swing foot that is loaded from below in the second half of swing
becomes a stance foot early, and a stance foot without load for `lost_contact_ms` is taken out of
the contact set and descends until it finds ground. A foot that is stopped from the side is no
support, however loaded: it stumbles and gives way (`feet`). Feet about to swing may be told to wait
for those that shall carry the robot instead; where it is pushed, that keeps it from stepping.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.controller.memory import Swings
from quadriga.shared.robot.a1 import FOOT_RADIUS, Array
from quadriga.shared.runtime.jit import compiled

_EARLIEST_TOUCHDOWN = 0.5  # of swing: before this a load is the foot still leaving the ground
_EARLIEST_STUMBLE = 0.12  # of swing, likewise
_LATEST_STUMBLE = 0.67  # of swing: after this a new swing would be a kick, maybe into a gap
_BELOW = 0.7  # of what a foot feels, share that must point upwards for the ground to be below it

Flags = NDArray[np.bool_]


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
def from_below(felt: Array) -> bool:
    """Whether what stops a foot, (3,), is under it and not beside it; nothing felt is no side."""
    size = np.sqrt(felt[0] ** 2 + felt[1] ** 2 + felt[2] ** 2)
    return bool(felt[2] >= _BELOW * size)


class ContactRule(NamedTuple):
    """When a foot is a contact.

    Attributes:
        threshold: force from which on a foot is loaded, N.
        patience: time without load after which a stance foot is no contact, s.
        hold: share of the half period for which a foot waits for those that shall stand.
        give_way: time for which a foot gives way once nothing stops it any more, s; 0: never.
        reject_side_contacts: whether a foot stopped from the side is no contact, and one that
            landed early and is not loaded any more neither.
    """

    threshold: float
    patience: float
    hold: float
    give_way: float
    reject_side_contacts: bool


@compiled
def contacts_by_force(
    legs0: Array,
    level0: float,
    switched: bool,
    stance: Array,
    progress: float,
    foot_force: Array,
    foot_z: Array,
    swings: Swings,
    rule: ContactRule,
    rate: float,
    dt: float,
) -> tuple[Array, float]:
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
        swings: lift and stumble are updated in place.
        rule: when a foot is a contact.
        rate: share of a tick in the filter of the ground's height.
        dt: time since the last tick, s.

    Returns:
        The new legs and level.
    """
    legs = legs0.copy()
    loaded = foot_force >= rule.threshold
    carried = _stand(legs, switched, stance, loaded, swings, rule, dt)
    _swing(legs, switched, stance, progress, loaded, carried, swings, rule, dt)
    return legs, _feel_ground(legs, level0, stance, loaded, foot_z, rate)


@compiled
def _stand(
    legs: Array,
    switched: bool,
    stance: Array,
    loaded: Flags,
    swings: Swings,
    rule: ContactRule,
    dt: float,
) -> bool:
    """Which of the feet that shall stand are contacts; whether they all carry."""
    contact, early, unloaded, _, _ = legs
    carried = True
    for leg in range(4):
        if stance[leg] < 0.5:
            continue
        carries = loaded[leg]
        if rule.reject_side_contacts and not switched and contact[leg] < 0.5:
            carries = carries and from_below(swings.felt[leg])
        if switched:
            early[leg] = 0.0
            unloaded[leg] = 0.0
        swings.lift[leg], swings.stumble[leg] = 0.0, 0.0
        unloaded[leg] = 0.0 if carries else unloaded[leg] + dt
        contact[leg] = 1.0 if unloaded[leg] <= rule.patience else 0.0
        carried = carried and carries
    return carried


@compiled
def _swing(
    legs: Array,
    switched: bool,
    stance: Array,
    progress: float,
    loaded: Flags,
    carried: bool,
    swings: Swings,
    rule: ContactRule,
    dt: float,
) -> None:
    """Which of the feet that shall swing stay on the ground, land early or stumble."""
    contact, early, unloaded, latched, _ = legs
    lift, stumble, felt = swings
    for leg in range(4):
        if stance[leg] > 0.5:
            continue
        if switched:
            latched[leg] = 0.0
            early[leg] = 0.0
            unloaded[leg] = 0.0
            stumble[leg] = 0.0
            lift[leg] = -1.0 if contact[leg] > 0.5 else 0.0
        if lift[leg] < 0.0:
            if carried or not loaded[leg] or progress >= rule.hold:
                lift[leg] = 0.0 if switched else progress
            else:
                contact[leg] = 1.0
                continue
        contact[leg] = 0.0
        since = (progress - lift[leg]) / (1.0 - lift[leg])
        below = not rule.reject_side_contacts or from_below(felt[leg])
        if loaded[leg] and below and since > _EARLIEST_TOUCHDOWN:
            early[leg] = 1.0
            unloaded[leg] = 0.0
            stumble[leg] = 0.0
        if early[leg] > 0.5:
            if rule.reject_side_contacts:
                unloaded[leg] = 0.0 if loaded[leg] else unloaded[leg] + dt
            contact[leg] = 1.0 if unloaded[leg] <= rule.patience else 0.0
        elif rule.give_way > 0.0:
            stopped = loaded[leg] and not below
            if stopped and since > _EARLIEST_STUMBLE and progress < _LATEST_STUMBLE:
                stumble[leg] = rule.give_way
            elif stumble[leg] > 0.0:
                stumble[leg] -= dt
                if stumble[leg] <= 0.0:
                    stumble[leg] = 0.0
                    lift[leg] = progress  # the swing begins anew from here


@compiled
def _feel_ground(
    legs: Array, level0: float, stance: Array, loaded: Flags, foot_z: Array, rate: float
) -> float:
    """Where the ground is under the feet in contact; its new filtered height."""
    contact, _, _, latched, ground = legs
    total, count = 0.0, 0
    for leg in range(4):
        # The ground is where the foot first bore load: latching at the scheduled touchdown
        # would take the height of a foot still in the air, and ratchet upward.
        if contact[leg] > 0.5 and loaded[leg] and latched[leg] < 0.5:
            latched[leg] = 1.0
            ground[leg] = foot_z[leg] - FOOT_RADIUS
        if contact[leg] > 0.5 and latched[leg] > 0.5:
            # The estimator's height drifts; a standing foot carries its ground along with it.
            ground[leg] += rate * (foot_z[leg] - FOOT_RADIUS - ground[leg])
            if stance[leg] > 0.5:
                total += ground[leg]
                count += 1
    return level0 + rate * (total / count - level0) if count > 0 else level0
