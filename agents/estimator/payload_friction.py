"""What a robot carries, and how much friction to count on: both from what its feet bear."""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.agents.estimator.leg_dynamics import COM, MASS, MOMENTS
from quadriga.shared.robots.conventions import GRAVITY, Array
from quadriga.shared.runtime.jit import compiled

_PAYLOAD_MOST: Final = 25.0  # kg; two robots' weight is no load that legs carry
_PAYLOAD_HEIGHT: Final = 0.08  # m, of a load's centre above the trunk's origin
_SETTLED: Final = 0.2  # of a half cycle: before this a foot may still be landing
_LOSS: Final = 15.0  # 1/s, of the coefficient counted on while a foot slides
_LOW_MU: Final = 0.1  # of the recovery, while the QP counts on less than `mu_min`


@compiled
def update_payload(state: np.record, gains: np.record) -> None:
    """Filter the load, kg: on average the feet bear the weight of robot and load.

    What yokes pull up or down counts as load. Robots that are lifted carry nothing.

    Args:
        state: `ROBOT_STATE` with the foot forces of this tick.
        gains: `GAINS`; with `load_time` 0 no load is assumed.
    """
    if gains.load_time > 0.0:
        rate = state.dt / (gains.load_time + state.dt)
        surplus = np.sum(state.foot_force) / GRAVITY - gains.mass
        payload = state.payload + rate * (surplus - state.payload)
        state.payload = min(_PAYLOAD_MOST, max(0.0, payload))


@compiled
def add_payload(links: Array, payload: float) -> Array:
    """`link_table` with a load, kg, on the middle of the trunk's top.

    Two bodies that move as one: the centre is the mean, and about it I = I₁ + I₂ +
    m₁ m₂ / (m₁ + m₂) (|d|² 1 − d dᵀ); the load is taken for a point.
    """
    rows = links.copy()
    com, moments, bare = rows[0, COM], rows[0, MOMENTS], rows[0, MASS]
    mass = bare + payload
    x, y, z = -com[0], -com[1], _PAYLOAD_HEIGHT - com[2]
    share, reduced = payload / mass, bare * payload / mass
    rows[0, MASS] = mass
    com[0] += share * x
    com[1] += share * y
    com[2] += share * z
    moments[0] += reduced * (y * y + z * z)
    moments[1] -= reduced * x * y
    moments[2] -= reduced * x * z
    moments[3] += reduced * (x * x + z * z)
    moments[4] -= reduced * y * z
    moments[5] += reduced * (x * x + y * y)
    return rows


@compiled
def update_mu_reduction(state: np.record, gains: np.record) -> None:
    """What is taken off the friction coefficient, so that feet that slide find hold again.

    A foot in contact slides where it moves along the ground faster than rolling would make it. A
    foot that slides gives less than the QP asks of it, and not in the direction asked; friction
    that is not there is then not counted on: ċ = 15/s while one slides, up to `mu` − `mu_min`.

    Feet slide on good ground too, where a push drags them along. But on a sliding foot |f_t| =
    μ f_n: where that μ is less than `mu_min`, c goes on to `mu` − μ, and no farther than `mu` −
    `mu_slippery`. While no foot slides ċ = −`mu_recovery`, and a tenth of that below `mu_min`:
    ground that was so slippery is so at the next step too.

    Args:
        state: `ROBOT_STATE` with `v_foot` of this tick.
        gains: `GAINS`.
    """
    if gains.slip_speed <= 0.0:
        state.mu_reduction = 0.0
        return
    slides, seen, v = False, gains.mu_min, state.v_foot
    if state.progress >= _SETTLED:
        for leg in range(4):
            stands = state.contact[leg] > 0.5 and state.stance[leg] > 0.5
            bears = stands and state.foot_force[leg] >= gains.slip_load
            if bears and v[leg, 0] ** 2 + v[leg, 1] ** 2 > gains.slip_speed**2:
                slides = True
                seen = min(seen, _measured_mu(state.ground_force[leg], gains))
    before = state.mu_reduction
    if slides:
        most = max(0.0, gains.mu - seen)
        state.mu_reduction = max(before, min(most, before + _LOSS * state.dt))
    else:
        is_low_mu = gains.mu - before < gains.mu_min - 1e-9
        share = _LOW_MU if is_low_mu else 1.0
        state.mu_reduction = max(0.0, before - share * gains.mu_recovery * state.dt)


@compiled
def _measured_mu(force: Array, gains: np.record) -> float:
    """Friction coefficient on a sliding foot, within `mu_slippery` and `mu_min`.

    Args:
        force: of the ground on it by the joints' torques, (3,), N; zero if unknown.
        gains: `GAINS`.
    """
    if force[2] < gains.slip_load:
        return float(gains.mu_min)
    mu = np.sqrt(force[0] ** 2 + force[1] ** 2) / force[2]
    return float(min(gains.mu_min, max(gains.mu_slippery, mu)))
