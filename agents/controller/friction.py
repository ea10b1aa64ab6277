"""How much friction to count on: less once feet slide, and slowly more again."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from quadriga.agents.controller.schedule import GaitPhase
from quadriga.agents.controller.sensed import FeetState
from quadriga.shared.config.sections import ControllerConfig
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.jit import compiled

_SETTLED = 0.2  # of a half cycle: before this a foot may still be landing
_LOSS = 15.0  # 1/s, of the coefficient counted on while a foot slides
_WARY = 0.1  # of the recovery, while the QP counts on less than `mu_min`


class FrictionRule(NamedTuple):
    """How much friction to count on.

    Attributes:
        slip_speed: from which on a foot slides, m/s; 0: never.
        slip_load: force from which on it matters, N: a foot that hardly bears load is easily
            dragged along, and shows nothing of the ground.
        mu: coefficient counted on where nothing slides.
        mu_min: coefficient that is counted on while feet slide.
        mu_slippery: coefficient that is counted on even where sliding feet feel less.
        recovery: by which what is taken off falls, 1/s.
    """

    slip_speed: float
    slip_load: float
    mu: float
    mu_min: float
    mu_slippery: float
    recovery: float


N_FRICTION_RULE: Final = len(FrictionRule._fields)


def friction_rule(config: ControllerConfig) -> FrictionRule:
    """The rule that a configuration sets."""
    return FrictionRule(
        slip_speed=config.slip_speed,
        slip_load=config.slip_load,
        mu=config.mu,
        mu_min=config.mu_min,
        mu_slippery=min(config.mu_min, config.mu_slippery),
        recovery=config.mu_recovery,
    )


@compiled
def update_mu_reduction(
    mu_reduction0: float,
    contact: Array,
    phase: GaitPhase,
    feet: FeetState,
    rule: FrictionRule,
    dt: float,
) -> float:
    """What is taken off the friction coefficient, so that feet that slide find hold again.

    A foot in contact slides where it moves along the ground faster than rolling would make it. A
    foot that slides gives less than the QP asks of it, and not in the direction asked; friction
    that is not there is then not counted on: ċ = 15/s while one slides, up to `mu` − `mu_min`.

    Feet slide on good ground too, where a push drags them along. But a sliding foot feels |f_t| =
    μ f_n: where that μ is less than `mu_min`, c goes on to `mu` − μ, and no farther than `mu` −
    `mu_slippery`. While no foot slides ċ = −`recovery`, and a tenth of that below `mu_min`: ground
    that was so slippery is so at the next step too.

    Args:
        mu_reduction0: c at the last tick.
        contact: 1 for the feet the QP may push on, (4,).
        phase: of the gait.
        feet: how they move and what they bear.
        rule: how much friction to count on.
        dt: time since the last tick, s.
    """
    if rule.slip_speed <= 0.0:
        return 0.0
    slides, seen = False, rule.mu_min
    stance, v, force = phase.stance, feet.velocity, feet.force
    if phase.progress >= _SETTLED:
        for leg in range(4):
            stands = contact[leg] > 0.5 and stance[leg] > 0.5 and force[leg] >= rule.slip_load
            if stands and v[leg, 0] ** 2 + v[leg, 1] ** 2 > rule.slip_speed**2:
                slides = True
                seen = min(seen, _friction_felt(feet.ground_force[leg], rule))
    if slides:
        most = max(0.0, rule.mu - seen)
        return max(mu_reduction0, min(most, mu_reduction0 + _LOSS * dt))
    wary = rule.mu - mu_reduction0 < rule.mu_min - 1e-9
    return max(0.0, mu_reduction0 - (_WARY if wary else 1.0) * rule.recovery * dt)


@compiled
def _friction_felt(force: Array, rule: FrictionRule) -> float:
    """Friction coefficient that a sliding foot feels, within `mu_slippery` and `mu_min`.

    Args:
        force: of the ground on it by the joints' torques, (3,), N; zero if unknown.
        rule: how much friction to count on.
    """
    normal = force[2]
    if normal < rule.slip_load:
        return rule.mu_min
    felt: float = np.sqrt(force[0] ** 2 + force[1] ** 2) / normal
    return min(rule.mu_min, max(rule.mu_slippery, felt))
