"""What a robot carries, and how much friction to count on: both from what its feet bear."""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.agents.estimator.rigid_body import COM, MASS, MOMENTS
from quadriga.shared.robots.conventions import GRAVITY, Array
from quadriga.shared.runtime.jit import compiled

_PAYLOAD_MOST: Final = 25.0  # kg; two robots' weight is no load that legs carry
_PAYLOAD_HEIGHT: Final = 0.08  # m, of a load's centre above the trunk's origin
MU_MIN: Final = 0.35  # the least coefficient that is counted on even while feet slide
_MU_SLIPPERY: Final = 0.12  # likewise, where feet that slide show less
MU_RECOVERY: Final = 2.0  # 1/s
SLIP_LOAD: Final = 20.0  # N, slip detection ignores a foot that bears less
_SETTLED: Final = 0.2  # of a half cycle: before this a foot may still be landing
_LOSS: Final = 15.0  # 1/s, of the coefficient counted on while a foot slides
_LOW_MU: Final = 0.1  # of the recovery, while the QP counts on less than `MU_MIN`


@compiled
def update_payload(state: np.record, gains: np.record) -> None:
    """Filter the load, kg: on average the feet bear the weight of robot and load.

    What yokes pull up or down counts as load. Robots that are lifted carry nothing. No load is
    assumed with `load_time` 0.
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
    that is not there is then not counted on: ċ = 15/s while one slides, up to `mu` − `MU_MIN`.

    Feet slide on good ground too, where a push drags them along. But on a sliding foot |f_t| =
    μ f_n: where that μ is less than `MU_MIN`, c goes on to `mu` − μ, and no farther than `mu` −
    `_MU_SLIPPERY`. While no foot slides ċ = −`MU_RECOVERY`, and a tenth of that below `MU_MIN`:
    ground that was so slippery is so at the next step too.
    """
    if gains.slip_speed <= 0.0:
        state.mu_reduction = 0.0
        return
    slides, seen, v = False, MU_MIN, state.v_foot
    if state.progress >= _SETTLED:
        for leg in range(4):
            stands = state.contact[leg] > 0.5 and state.stance[leg] > 0.5
            bears = stands and state.foot_force[leg] >= SLIP_LOAD
            if bears and v[leg, 0] ** 2 + v[leg, 1] ** 2 > gains.slip_speed**2:
                slides = True
                force = state.ground_force[leg]  # by the joints' torques; zero if unknown
                if force[2] >= SLIP_LOAD:
                    mu = np.sqrt(force[0] ** 2 + force[1] ** 2) / force[2]
                    seen = min(seen, max(_MU_SLIPPERY, mu))
    before = state.mu_reduction
    if slides:
        most = max(0.0, gains.mu - seen)
        state.mu_reduction = max(before, min(most, before + _LOSS * state.dt))
    else:
        is_low_mu = gains.mu - before < MU_MIN - 1e-9
        share = _LOW_MU if is_low_mu else 1.0
        state.mu_reduction = max(0.0, before - share * MU_RECOVERY * state.dt)
