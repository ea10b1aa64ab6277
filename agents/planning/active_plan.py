"""Plans in force: what each must keep to, and which of them is applied at a tick."""

from __future__ import annotations

from dataclasses import field, replace
from typing import Any, Final

import numpy as np

from quadriga.agents.gait import nominal_forces, scheduled_stance
from quadriga.agents.planner.qp_solver import NOMINAL
from quadriga.agents.plausibility import OUTPUT_MAX
from quadriga.agents.predictor.episode import commanded_outputs
from quadriga.agents.time_grid import sample_starts, step_ms
from quadriga.shared.codes import with_detail
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Plan, Reference
from quadriga.shared.robots.conventions import N_FORCES, N_LEGS, N_OUTPUTS, Array
from quadriga.shared.runtime.record import record
from quadriga.shared.topics import SAMPLE_MS

_NO_FORCE = np.zeros(12)
# A planner's own plans keep to deviation_max: the share and N on top are for its solver.
# With forces far beyond it a single plan would drive all joints to their limits.
_SHARE: Final = 1.5
_MARGIN: Final = 1.0  # N
FARTHEST: Final = 10.0  # m, m/s, rad, rad/s: no trunk gets there, whatever is predicted


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
        y_ref: outputs to follow at the end of this sample, (6,); None without a plan.
    """

    deviation: Array = field(default_factory=_NO_FORCE.copy)
    y_ref: Array | None = None


_NO_SETPOINT = Setpoint()


class PlanCheck:
    """What every plan of a robot must keep to, whoever has made it; and what comes in its place.

    Faults are told without figures that differ from plan to plan; "" is none.

    Args:
        config: the team's configuration.
        index: the robot's place in the team, 0-based.
    """

    def __init__(self, config: Config, index: int) -> None:
        self._config, self._index, self._step_ms = config, index, step_ms(config)
        self._most = _SHARE * np.tile(config.planner.deviation_max, N_LEGS) + _MARGIN  # (12,), N
        # Nominal forces by the gait's phase: a memo, it changes no result.
        self._nominal: dict[int, Array] = {}
        self.counter = f"refused_plan_of_{config.planner.kind}"

    def nominal(self, plan_tick: int) -> Array:
        """Nominal forces of the N samples from a tick on. Shape (N, 12), N."""
        since, period = plan_tick - self._config.gait.stand_ms, 2 * self._config.gait.stance_ms
        phase = since % period if since >= 0 else since
        if phase not in self._nominal:
            ticks = sample_starts(plan_tick, self._config.planner.N)
            stance = scheduled_stance(self._config, self._index, ticks)
            self._nominal[phase] = nominal_forces(stance, self._config.robot.weight)
        return self._nominal[phase]

    def fault_of(self, plan: Plan, now: int, y_max: float = OUTPUT_MAX) -> str:
        """Why a plan cannot be meant at a tick, with outputs up to a magnitude."""
        if plan.tick != plan.step * self._step_ms:
            return "a tick that is not that of its step"
        return self._find_fault(now, plan.tick, plan.u, plan.y, y_max)

    def fault_of_active(self, plan: ActivePlan, now: int) -> str:
        """The same of a plan that is to be applied."""
        if plan.start < now:
            return "a start that is over"
        values = plan.deviation, plan.outputs
        return self._find_fault(now, plan.plan_tick, *values, FARTHEST, deviation=True)

    def _find_fault(
        self, now: int, plan_tick: int, u: Any, y: Any, y_max: float, *, deviation: bool = False
    ) -> str:
        """Of forces u, or what they deviate by from nominal, (N, 12), N, and outputs y, (N, 6)."""
        N = self._config.planner.N
        for name, values, width in (("forces", u, N_FORCES), ("outputs", y, N_OUTPUTS)):
            if not isinstance(values, np.ndarray) or values.dtype != np.float64:
                got = getattr(values, "dtype", type(values).__name__)
                return f"{name} of type {got} instead of an array of float64"
            if values.shape != (N, width):
                got = "x".join(map(str, values.shape))
                return f"{name} of shape {got} instead of {N}x{width}"
            if not np.isfinite(values).all():
                return f"{name} that are not finite"
        if not 0 <= now - plan_tick < SAMPLE_MS * N:
            return "samples of another time"
        if np.abs(y).max() > y_max:
            return f"outputs beyond {y_max:g} m or m/s or rad or rad/s"
        nominal = self.nominal(plan_tick)
        if (np.abs(u if deviation else u - nominal) > self._most).any():
            return "forces that deviate by more than planner.deviation_max"
        feet = (nominal + u if deviation else u).reshape(N, N_LEGS, 3)
        swing = nominal.reshape(N, N_LEGS, 3)[..., 2] == 0.0
        if np.abs(feet[swing]).max(initial=0.0) > _MARGIN:
            return "forces of a leg that swings"
        held = self._config.planner.mu * feet[..., 2] + _MARGIN
        if (np.hypot(feet[..., 0], feet[..., 1]) > held).any():
            return "forces outside the friction cone of planner.mu"
        return ""

    def replacement(self, plan: Plan, fault: str, now: int, reference: Reference) -> Plan:
        """Nominal forces and desired outputs in the place of a plan that has a fault.

        Args:
            plan: what its planner has made.
            fault: what is wrong with it.
            now: tick within the planning step.
            reference: in force.
        """
        step = now // self._step_ms
        tick = step * self._step_ms
        u = self.nominal(tick)
        y = np.tile(commanded_outputs(reference), (len(u), 1))
        status = with_detail(NOMINAL, f"plan of {self._config.planner.kind} refused: {fault}")
        stamp_ns = tick * 1_000_000
        return replace(plan, tick=tick, stamp_ns=stamp_ns, step=step, u=u, y=y, status=status)


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
                return Setpoint(plan.deviation[sample], plan.outputs[sample])
            break
    return _NO_SETPOINT
