"""From scheduled stance and loaded feet to the contacts the QP may push on, and the ground height.

With contact detection on, a swing foot that is loaded from below in the second half of swing
becomes a stance foot early, and a stance foot without load for `_LOST` is taken out of
the contact set and descends until it finds ground. A foot that is stopped from the side is no
support, however loaded: it retracts, up and back from what stopped it (`controller.swing`).
"""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.jit import compiled

_EARLIEST_TOUCHDOWN: Final = 0.5  # of swing: before this a load is the foot still leaving
_EARLIEST_RETRACTION: Final = 0.12  # of swing, likewise
_LATEST_RETRACTION: Final = 0.67  # of the half cycle: later, a new swing would be a kick
_LOST: Final = 5e-3  # s, for which a foot is without load until it is no contact
_GROUND_FILTER: Final = 0.05  # s, time constant of the ground height
_BELOW: Final = 0.7  # share of the reaction that must point upwards for ground below the foot


@compiled
def update_contacts(state: np.record, gains: np.record) -> None:
    """Update contacts and ground heights from the foot loads and places of this tick."""
    rate = state.dt / (_GROUND_FILTER + state.dt)
    sole_z = state.p_foot[:, 2] - gains.foot_radius
    for leg in range(4):
        stands = state.stance[leg] > 0.5
        if gains.contact_detection < 0.5:
            # The paper's plain setting: contacts are the schedule's, the ground is flat and known.
            state.contact[leg] = state.touchdown_seen[leg] = state.stance[leg]
            state.early_contact[leg] = state.unloaded[leg] = 0.0
            state.ground[leg] = sole_z[leg] if stands else state.ground[leg]
        elif stands:
            _update_stance(state, gains, leg)
        else:
            _update_swing(state, gains, leg)
    _update_ground(state, sole_z, rate)


@compiled
def is_from_below(reaction: Array) -> bool:
    """Whether what stops a foot, (3,), m/s², is under it and not beside it; true of nothing."""
    size = np.sqrt(reaction[0] ** 2 + reaction[1] ** 2 + reaction[2] ** 2)
    return bool(reaction[2] >= _BELOW * size)


@compiled
def _update_stance(state: np.record, gains: np.record, leg: int) -> None:
    """Whether a foot that shall stand is a contact."""
    carries = state.foot_loaded[leg] > 0.5
    if gains.reject_side_contacts > 0.5 and state.switched < 0.5 and state.contact[leg] < 0.5:
        carries = carries and is_from_below(state.reaction[leg])
    if state.switched > 0.5:
        state.early_contact[leg] = state.unloaded[leg] = 0.0
    state.lift[leg] = state.retraction[leg] = 0.0
    state.unloaded[leg] = 0.0 if carries else state.unloaded[leg] + state.dt
    state.contact[leg] = 0.0 if state.unloaded[leg] > _LOST else 1.0


@compiled
def _update_swing(state: np.record, gains: np.record, leg: int) -> None:
    """Whether a foot that shall swing has landed early, or retracts."""
    if state.switched > 0.5:
        state.touchdown_seen[leg] = state.early_contact[leg] = state.unloaded[leg] = 0.0
        state.retraction[leg] = state.lift[leg] = 0.0
    state.contact[leg] = 0.0
    loaded, rejects = state.foot_loaded[leg] > 0.5, gains.reject_side_contacts > 0.5
    swung = (state.progress - state.lift[leg]) / (1.0 - state.lift[leg])
    below = not rejects or is_from_below(state.reaction[leg])
    if loaded and below and swung > _EARLIEST_TOUCHDOWN:
        state.early_contact[leg] = 1.0
        state.unloaded[leg] = state.retraction[leg] = 0.0
    if state.early_contact[leg] > 0.5:
        if rejects:
            state.unloaded[leg] = 0.0 if loaded else state.unloaded[leg] + state.dt
        state.contact[leg] = 0.0 if state.unloaded[leg] > _LOST else 1.0
    elif gains.reflex_ms > 0.0:
        in_time = swung > _EARLIEST_RETRACTION and state.progress < _LATEST_RETRACTION
        if loaded and not below and in_time:
            state.retraction[leg] = 1e-3 * gains.reflex_ms
        elif state.retraction[leg] > 0.0:
            state.retraction[leg] -= state.dt
            if state.retraction[leg] <= 0.0:  # the swing begins anew
                state.retraction[leg] = 0.0
                state.lift[leg] = state.progress


@compiled
def _update_ground(state: np.record, sole_z: Array, rate: float) -> None:
    """Where the ground is under the feet in contact, and its filtered height."""
    total, count = 0.0, 0
    for leg in range(4):
        if state.contact[leg] < 0.5:
            continue
        # The ground is where the foot first bore load: to take its height at the scheduled
        # touchdown would take that of a foot still in the air, and ratchet upward.
        if state.foot_loaded[leg] > 0.5 and state.touchdown_seen[leg] < 0.5:
            state.touchdown_seen[leg] = 1.0
            state.ground[leg] = sole_z[leg]
        if state.touchdown_seen[leg] > 0.5:
            # The estimator's height drifts; a standing foot carries its ground along with it.
            state.ground[leg] += rate * (sole_z[leg] - state.ground[leg])
            if state.stance[leg] > 0.5:
                total += state.ground[leg]
                count += 1
    if count > 0:
        state.ground_height += rate * (total / count - state.ground_height)
