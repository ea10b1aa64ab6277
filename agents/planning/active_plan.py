"""Plans in force: which of them is applied at a tick, and from which sample on."""

from __future__ import annotations

from dataclasses import field

import numpy as np

from quadriga.shared.robot.conventions import Array
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
        y_ref: all outputs to follow at the end of this sample, (6,); None without a plan.
    """

    deviation: Array = field(default_factory=_NO_FORCE.copy)
    v_ref: Array | None = None
    y_ref: Array | None = None


_NO_SETPOINT = Setpoint()


def add_plan(plans: tuple[ActivePlan, ...], new: ActivePlan) -> tuple[ActivePlan, ...]:
    """Add a plan; of those before it only what is still needed stays."""
    current = [plan for plan in plans if plan.start <= new.plan_tick][-1:]
    waiting = [plan for plan in plans if new.plan_tick < plan.start < new.start]
    return (*current, *waiting, new)


def setpoint_at(plans: tuple[ActivePlan, ...], tick: int) -> Setpoint:
    """What the newest plan in force says for this tick; nothing once it has run out."""
    for plan in reversed(plans):
        if plan.start <= tick:
            sample = (tick - plan.plan_tick) // SAMPLE_MS
            if 0 <= sample < len(plan.deviation):
                outputs = plan.outputs[sample:]
                return Setpoint(plan.deviation[sample], outputs[:, 1:3], outputs[0])
            break
    return _NO_SETPOINT
