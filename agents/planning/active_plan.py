"""Plans in force: what each must keep to, how much of it is applied, and which at a tick."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final, NamedTuple

import numpy as np

from quadriga.agents.gait import nominal_forces, sample_starts, scheduled_stance, step_ms
from quadriga.agents.planner.solver import NOMINAL
from quadriga.agents.planning.interface import ActivePlan, PlanningInputs, PlanningOutputs
from quadriga.agents.planning.references import reference_at
from quadriga.agents.predictor.episode import commanded_outputs
from quadriga.shared.codes import with_detail
from quadriga.shared.config.sections import Config, PlannerConfig
from quadriga.shared.messages import Plan
from quadriga.shared.modes import WALK
from quadriga.shared.robots.conventions import N_FORCES, N_LEGS, N_OUTPUTS, Array
from quadriga.shared.topics import SAMPLE_MS

# A planner's own plans keep to deviation_max: the share and N on top are for its solver.
# With forces far beyond it a single plan would drive all joints to their limits.
_SHARE: Final = 1.5
_MARGIN: Final = 1.0  # N
FADED: Final = "faded"  # status of a plan that is applied in part
FARTHEST: Final = 10.0  # m, m/s, rad, rad/s: no trunk gets there, whatever is predicted


class Setpoint(NamedTuple):
    """What is applied at one tick.

    Attributes:
        deviation: force deviation, (12,), N, yaw frame.
        y_ref: outputs to follow at the end of this sample, (6,); None without a plan.
    """

    deviation: Array
    y_ref: Array | None


_NO_SETPOINT: Final = Setpoint(np.zeros(N_FORCES), None)


class PlanCheck:
    """What every plan of robot `index`, 0-based, must keep to, whoever has made it."""

    def __init__(self, config: Config, index: int) -> None:
        self._config, self._index, self._step_ms = config, index, step_ms(config)
        self._most = _SHARE * np.tile(config.planner.deviation_max, N_LEGS) + _MARGIN  # (12,), N
        self._nominal: dict[int, Array] = {}  # by the gait's phase: a memo, it changes no result

    def nominal(self, plan_tick: int) -> Array:
        """Nominal forces of the N samples from a tick on. Shape (N, 12), N."""
        since, period = plan_tick - self._config.gait.stand_ms, 2 * self._config.gait.stance_ms
        phase = since % period if since >= 0 else since
        if phase not in self._nominal:
            ticks = sample_starts(plan_tick, self._config.planner.N)
            stance = scheduled_stance(self._config, self._index, ticks)
            self._nominal[phase] = nominal_forces(stance, self._config.robot.weight)
        return self._nominal[phase]

    def fault_of(self, plan: Plan, now: int) -> str:
        """Why a plan cannot be meant at a tick; "": it can."""
        if plan.tick != plan.step * self._step_ms:
            return "a tick that is not that of its step"
        return self._find_fault(now, plan.tick, plan.u, plan.y)

    def fault_of_active(self, plan: ActivePlan, now: int) -> str:
        """The same of a plan that is to be applied."""
        if plan.start < now:
            return "a start that is over"
        u, nominal = plan.deviation, self.nominal(plan.plan_tick)
        u = nominal + u if np.shape(u) == nominal.shape else u
        return self._find_fault(now, plan.plan_tick, u, plan.outputs)

    def admit(
        self, outputs: PlanningOutputs, inputs: PlanningInputs, plans: tuple[ActivePlan, ...]
    ) -> tuple[PlanningOutputs, tuple[ActivePlan, ...]]:
        """What a step of planning gave, and the plans in force with it.

        In the place of a plan that cannot be meant come nominal forces and the desired outputs,
        with a status that names the planner and the fault. A robot that does not walk has none.
        `plans` are those in force before.
        """
        plan, active = outputs.plan, outputs.active
        fault = "" if plan is None else self.fault_of(plan, inputs.tick)
        if active is not None:
            fault = fault or self.fault_of_active(active, inputs.tick)
        if fault:
            outputs = self._refuse(outputs, inputs, fault)
        plans = plans if inputs.mode.name == WALK else ()
        return outputs, plans if outputs.active is None else add_plan(plans, outputs.active)

    def _refuse(
        self, outputs: PlanningOutputs, inputs: PlanningInputs, fault: str
    ) -> PlanningOutputs:
        """Nominal forces from now on, published if the planner's plan was to be."""
        kind, step = self._config.planner.kind, inputs.tick // self._step_ms
        tick, plan = step * self._step_ms, outputs.plan
        u, height = self.nominal(tick), self._config.reference.height
        reference, _ = reference_at(inputs.references, inputs.tick, height)
        y = np.tile(commanded_outputs(reference), (len(u), 1))
        if plan is not None:
            status = with_detail(NOMINAL, f"plan of {kind} refused: {fault}")
            plan = Plan(tick, tick * 1_000_000, step, u, y, status, plan.used, plan.exchange)
        active = ActivePlan(inputs.tick, tick, np.zeros_like(u), y)
        unusual = (*outputs.unusual, f"refused_plan_of_{kind}")
        return replace(outputs, plan=plan, active=active, unusual=unusual)

    def _find_fault(self, now: int, plan_tick: int, u: Any, y: Any) -> str:
        """Of forces u, (N, 12), N, and outputs y, (N, 6). It has no figures, which would vary."""
        N = self._config.planner.N
        for name, values, width in (("forces", u, N_FORCES), ("outputs", y, N_OUTPUTS)):
            if getattr(values, "dtype", None) != np.float64 or values.shape != (N, width):
                return f"{name} that are not an array of {N}x{width} float64"
            if not np.isfinite(values).all():
                return f"{name} that are not finite"
        if not 0 <= now - plan_tick < SAMPLE_MS * N:
            return "samples of another time"
        if np.abs(y).max() > FARTHEST:
            return f"outputs beyond {FARTHEST:g} m or m/s or rad or rad/s"
        nominal = self.nominal(plan_tick)
        if (np.abs(u - nominal) > self._most).any():
            return "forces that deviate by more than planner.deviation_max"
        feet, swing = u.reshape(N, N_LEGS, 3), nominal[:, 2::3] == 0.0
        if np.abs(feet[swing]).max(initial=0.0) > _MARGIN:
            return "forces of a leg that swings"
        held = self._config.planner.mu * feet[..., 2] + _MARGIN
        if (np.hypot(feet[..., 0], feet[..., 1]) > held).any():
            return "forces outside the friction cone of planner.mu"
        return ""


def trust_scaling(config: PlannerConfig, error: Array) -> float:
    """Share of a plan to apply: 1 inside the range of the data, falling to 0 at twice that range.

    `error` is that of the present outputs, (6,); one that is no number is out of every range.
    """
    z, speed, tilt, turn = config.trust_range
    ranges = np.array([z, speed, speed, tilt, tilt, turn])
    share = 2.0 - float(np.maximum.reduce(np.abs(error) / ranges))
    return min(1.0, share) if share > 0.0 else 0.0  # 0 if it is NaN


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
