"""Plans in force: what is applied at a tick, from when on, and how it fades out."""

from __future__ import annotations

from dataclasses import field

import numpy as np

from quadriga.shared.config.sections import PlannerConfig
from quadriga.shared.robot.a1 import Array
from quadriga.shared.runtime.record import record
from quadriga.shared.wire.topics import SAMPLE_MS

_NO_FORCE = np.zeros(12)


@record
class ActivePlan:
    """One plan on its way: N samples from `plan_tick` on, in force from `start` on.

    Attributes:
        start: tick from which it is applied.
        plan_tick: tick of its first sample.
        deviation: force deviations from nominal, (N, 12), N.
        outputs: outputs to follow, (N, 6): the planned ones, or in part those asked for.
    """

    start: int
    plan_tick: int
    deviation: Array
    outputs: Array


@record
class Setpoint:
    """What is applied at one tick.

    Attributes:
        deviation: force deviation, (12,), N, yaw frame.
        v_ref: vx, vy to follow at the ends of this sample and of those after it, (k, 2), m/s;
            None without a plan.
    """

    deviation: Array = field(default_factory=_NO_FORCE.copy)
    v_ref: Array | None = None


_NOTHING = Setpoint()


def launched(flights: tuple[ActivePlan, ...], new: ActivePlan) -> tuple[ActivePlan, ...]:
    """Add a plan; of those before it only what is still needed stays."""
    current = [flight for flight in flights if flight.start <= new.plan_tick][-1:]
    waiting = [flight for flight in flights if new.plan_tick < flight.start < new.start]
    return (*current, *waiting, new)


def present(flights: tuple[ActivePlan, ...], tick: int) -> Setpoint:
    """What the newest plan in force says for this tick; nothing once it has run out."""
    for flight in reversed(flights):
        if flight.start <= tick:
            sample = (tick - flight.plan_tick) // SAMPLE_MS
            if not 0 <= sample < len(flight.deviation):
                break
            return Setpoint(flight.deviation[sample], flight.outputs[sample:, 1:3])
    return _NOTHING


def fading(config: PlannerConfig, error: Array) -> float:
    """Share of a plan to apply: 1 inside the range of the data, falling to 0 at twice that range.

    An error that is no number is out of every range.

    Args:
        config: the range.
        error: present outputs less the desired ones, shape (6,).
    """
    ranges = np.array(config.fade)[[0, 1, 1, 2, 2, 3]]
    share = float(np.clip(2.0 - np.max(np.abs(error) / ranges), 0.0, 1.0))
    return share if share > 0.0 else 0.0
