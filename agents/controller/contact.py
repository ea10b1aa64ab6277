"""From scheduled stance and loaded feet to the contacts the QP may push on, and the ground height.

With contact detection on, a swing foot that is loaded from below in the second half of swing
becomes a stance foot early, and a stance foot without load for `lost_contact_ms` is taken out of
the contact set and descends until it finds ground. A foot that is stopped from the side is no
support, however loaded: it shows a reflex, up and back from what stopped it (`foot_targets`). Feet
about to swing may be told to wait for those that shall carry the robot instead; where it is pushed,
that keeps it from stepping.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from quadriga.agents.controller.foot_load import Flags
from quadriga.agents.controller.memory import FeetMemory
from quadriga.agents.controller.schedule import GaitPhase
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.jit import compiled

_EARLIEST_TOUCHDOWN = 0.5  # of swing: before this a load is the foot still leaving the ground
_EARLIEST_REFLEX = 0.12  # of swing, likewise
_LATEST_REFLEX = 0.67  # of the half cycle: later, a new swing would be a kick, maybe into a gap
_BELOW = 0.7  # share of the reaction that must point upwards for the ground to be below the foot


class ContactRule(NamedTuple):
    """When a foot is a contact.

    Attributes:
        detection: 1: by load; 0: by the schedule alone.
        lost_after: time without load after which a stance foot is no contact, s.
        hold: share of the half cycle for which a foot waits for those that shall stand.
        reflex: time for which a foot backs off once nothing stops it any more, s; 0: never.
        reject_side_contacts: 1 where a foot stopped from the side is no contact, and one that
            landed early and is not loaded any more neither; else 0.
        ground_filter: time constant of the filters of the ground's height, s.
        foot_radius: m.
    """

    detection: float
    lost_after: float
    hold: float
    reflex: float
    reject_side_contacts: float
    ground_filter: float
    foot_radius: float


N_CONTACT_RULE: Final = len(ContactRule._fields)


def contact_rule(config: Config) -> ContactRule:
    """The rule that a configuration sets, for its robot."""
    controller = config.controller
    return ContactRule(
        detection=float(controller.contact_detection),
        lost_after=1e-3 * controller.lost_contact_ms,
        hold=controller.liftoff_hold_ms / config.gait.stance_ms,
        reflex=1e-3 * controller.reflex_ms,
        reject_side_contacts=float(controller.reject_side_contacts),
        ground_filter=1e-3 * controller.ground_filter_ms,
        foot_radius=config.robot.geometry.foot_radius,
    )


@compiled
def update_contacts(
    feet: FeetMemory,
    ground_height0: float,
    phase: GaitPhase,
    loaded: Flags,
    foot_z: Array,
    rule: ContactRule,
    dt: float,
) -> float:
    """Update the contacts of one robot.

    Args:
        feet: what is remembered of them; changed in place.
        ground_height0: filtered height of the ground under the stance feet at the last tick, m.
        phase: of the gait.
        loaded: which feet bear load, (4,).
        foot_z: heights of the foot centres, (4,), m, odometry frame.
        rule: when a foot is a contact.
        dt: time since the last tick, s.

    Returns:
        The new height of the ground, m, odometry frame.
    """
    rate = dt / (rule.ground_filter + dt)
    sole_z = foot_z - rule.foot_radius
    if rule.detection < 0.5:
        return _follow_schedule(feet, ground_height0, phase.stance, sole_z, rate)
    carried = _update_stance(feet, phase, loaded, rule, dt)
    _update_swing(feet, phase, loaded, carried, rule, dt)
    return _update_ground(feet, ground_height0, phase.stance, loaded, sole_z, rate)


@compiled
def _follow_schedule(
    feet: FeetMemory, ground_height0: float, stance: Array, sole_z: Array, rate: float
) -> float:
    """The paper's plain setting: contacts are the schedule's, the ground is flat and known."""
    contact, early_contact = feet.contact, feet.early_contact
    unloaded, touchdown_seen = feet.unloaded, feet.touchdown_seen
    ground = feet.ground
    total, count = 0.0, 0
    for leg in range(4):
        contact[leg] = touchdown_seen[leg] = stance[leg]
        early_contact[leg] = unloaded[leg] = 0.0
        if stance[leg] > 0.5:
            ground[leg] = sole_z[leg]
            total += ground[leg]
            count += 1
    return ground_height0 + rate * (total / count - ground_height0)


@compiled
def from_below(reaction: Array) -> bool:
    """Whether what stops a foot is under it and not beside it; true where nothing stops it.

    Args:
        reaction: see `Memory.reaction`, (3,), m/s².
    """
    size = np.sqrt(reaction[0] ** 2 + reaction[1] ** 2 + reaction[2] ** 2)
    return bool(reaction[2] >= _BELOW * size)


@compiled
def _update_stance(
    feet: FeetMemory, phase: GaitPhase, loaded: Flags, rule: ContactRule, dt: float
) -> bool:
    """Which of the feet that shall stand are contacts; whether they all carry."""
    contact, early_contact = feet.contact, feet.early_contact
    unloaded, lift = feet.unloaded, feet.lift
    reflex, reaction = feet.reflex, feet.reaction
    stance, switched = phase.stance, phase.switched
    carried = True
    for leg in range(4):
        if stance[leg] < 0.5:
            continue
        carries = loaded[leg]
        if rule.reject_side_contacts > 0.5 and not switched and contact[leg] < 0.5:
            carries = carries and from_below(reaction[leg])
        if switched:
            early_contact[leg] = 0.0
            unloaded[leg] = 0.0
        lift[leg], reflex[leg] = 0.0, 0.0
        unloaded[leg] = 0.0 if carries else unloaded[leg] + dt
        contact[leg] = 1.0 if unloaded[leg] <= rule.lost_after else 0.0
        carried = carried and carries
    return carried


@compiled
def _update_swing(
    feet: FeetMemory, phase: GaitPhase, loaded: Flags, carried: bool, rule: ContactRule, dt: float
) -> None:
    """Which of the feet that shall swing stay on the ground, land early or show a reflex.

    Args:
        feet: what is remembered of them; changed in place.
        phase: of the gait.
        loaded: which feet bear load, (4,).
        carried: whether all feet that shall stand carry.
        rule: when a foot is a contact.
        dt: time since the last tick, s.
    """
    contact, early_contact = feet.contact, feet.early_contact
    unloaded, touchdown_seen = feet.unloaded, feet.touchdown_seen
    lift, reflex = feet.lift, feet.reflex
    reaction = feet.reaction
    stance, progress, switched = phase
    rejects = rule.reject_side_contacts > 0.5
    for leg in range(4):
        if stance[leg] > 0.5:
            continue
        if switched:
            touchdown_seen[leg] = 0.0
            early_contact[leg] = 0.0
            unloaded[leg] = 0.0
            reflex[leg] = 0.0
            lift[leg] = -1.0 if contact[leg] > 0.5 else 0.0
        if lift[leg] < 0.0:
            if not carried and loaded[leg] and progress < rule.hold:
                contact[leg] = 1.0
                continue
            lift[leg] = 0.0 if switched else progress
        contact[leg] = 0.0
        since = (progress - lift[leg]) / (1.0 - lift[leg])
        below = not rejects or from_below(reaction[leg])
        if loaded[leg] and below and since > _EARLIEST_TOUCHDOWN:
            early_contact[leg] = 1.0
            unloaded[leg] = 0.0
            reflex[leg] = 0.0
        if early_contact[leg] > 0.5:
            if rejects:
                unloaded[leg] = 0.0 if loaded[leg] else unloaded[leg] + dt
            contact[leg] = 1.0 if unloaded[leg] <= rule.lost_after else 0.0
        elif rule.reflex > 0.0:
            stopped = loaded[leg] and not below
            in_time = since > _EARLIEST_REFLEX and progress < _LATEST_REFLEX
            _update_reflex(feet, leg, stopped and in_time, progress, rule.reflex, dt)


@compiled
def _update_reflex(
    feet: FeetMemory, leg: int, stopped: bool, progress: float, duration: float, dt: float
) -> None:
    """Begin a foot's reflex, or let time pass in it; at its end the swing begins anew."""
    lift, reflex = feet.lift, feet.reflex
    if stopped:
        reflex[leg] = duration
    elif reflex[leg] > 0.0:
        reflex[leg] -= dt
        if reflex[leg] <= 0.0:
            reflex[leg] = 0.0
            lift[leg] = progress


@compiled
def _update_ground(
    feet: FeetMemory,
    ground_height0: float,
    stance: Array,
    loaded: Flags,
    sole_z: Array,
    rate: float,
) -> float:
    """Where the ground is under the feet in contact; its new filtered height."""
    contact, touchdown_seen = feet.contact, feet.touchdown_seen
    ground = feet.ground
    total, count = 0.0, 0
    for leg in range(4):
        # The ground is where the foot first bore load: to take its height at the scheduled
        # touchdown would take that of a foot still in the air, and ratchet upward.
        if contact[leg] > 0.5 and loaded[leg] and touchdown_seen[leg] < 0.5:
            touchdown_seen[leg] = 1.0
            ground[leg] = sole_z[leg]
        if contact[leg] > 0.5 and touchdown_seen[leg] > 0.5:
            # The estimator's height drifts; a standing foot carries its ground along with it.
            ground[leg] += rate * (sole_z[leg] - ground[leg])
            if stance[leg] > 0.5:
                total += ground[leg]
                count += 1
    return ground_height0 + rate * (total / count - ground_height0) if count > 0 else ground_height0
