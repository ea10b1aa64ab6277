"""How much friction to count on: less once feet slide, and slowly more again."""

from __future__ import annotations

from typing import Final, NamedTuple

from quadriga.agents.controller.schedule import GaitPhase
from quadriga.agents.controller.sensed import FeetState
from quadriga.shared.config.sections import ControllerConfig
from quadriga.shared.robot.conventions import Array
from quadriga.shared.runtime.jit import compiled

_SETTLED = 0.2  # of a half cycle: before this a foot may still be landing
_LOSS = 15.0  # 1/s, of the coefficient counted on while a foot slides


class FrictionRule(NamedTuple):
    """How much friction to count on.

    Attributes:
        slip_speed: from which on a foot slides, m/s; 0: never.
        slip_load: force from which on it matters, N: a foot that hardly bears load is easily
            dragged along, and shows nothing of the ground.
        mu: coefficient counted on where nothing slides.
        mu_min: coefficient that is always counted on.
        recovery: by which what is taken off falls, 1/s.
    """

    slip_speed: float
    slip_load: float
    mu: float
    mu_min: float
    recovery: float


N_FRICTION_RULE: Final = len(FrictionRule._fields)


def friction_rule(config: ControllerConfig) -> FrictionRule:
    """The rule that a configuration sets."""
    return FrictionRule(
        slip_speed=config.slip_speed,
        slip_load=config.slip_load,
        mu=config.mu,
        mu_min=config.mu_min,
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
    that is not there is then not counted on: ċ = 15/s while one slides, ċ = −`recovery` else, and
    0 ≤ c ≤ `mu` − `mu_min`.

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
    slides, stance, v, force = False, phase.stance, feet.velocity, feet.force
    if phase.progress >= _SETTLED:
        for leg in range(4):
            if contact[leg] > 0.5 and stance[leg] > 0.5 and force[leg] >= rule.slip_load:
                slides = slides or v[leg, 0] ** 2 + v[leg, 1] ** 2 > rule.slip_speed**2
    rate = _LOSS if slides else -rule.recovery
    return min(max(0.0, rule.mu - rule.mu_min), max(0.0, mu_reduction0 + rate * dt))
