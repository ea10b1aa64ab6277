"""Forces in proportion to filtered errors of speed, height and tilt, held over the horizon."""

import numpy as np

from quadriga.agents.gait import first_step, horizon_stance, nominal_forces, step_ms
from quadriga.agents.planning.interface import (
    ActivePlan,
    PlanningInputs,
    PlanningInterface,
    PlanningOutputs,
)
from quadriga.agents.planning.references import reference_at
from quadriga.agents.predictor.episode import commanded_outputs
from quadriga.shared.messages import Plan
from quadriga.shared.modes import WALK
from quadriga.shared.robots.conventions import Array

FRONT, LEFT = np.array([1, 1, -1, -1]), np.array([1, -1, 1, -1])  # of FL FR RL RR


class Balance(PlanningInterface[Array]):  # its state: filtered errors, (6,)
    def __init__(self, config, index, predictor, clock_ns) -> None:  # type: ignore[no-untyped-def]
        self.config, self.index, self.step_ms = config, index, step_ms(config)
        self.speed, self.height, self.tilt = config.planner.option_values.values()

    def initial(self) -> Array:
        return np.zeros(6)

    def step(self, errors: Array, inputs: PlanningInputs) -> tuple[Array, PlanningOutputs]:
        sample, tick = inputs.measurement, inputs.tick
        if sample is None or inputs.mode.name != WALK:
            return errors, PlanningOutputs()
        now, _ = reference_at(inputs.references, tick, self.config.reference.height)
        wanted = commanded_outputs(now)
        errors = 0.8 * errors + 0.2 * (sample.y - wanted)
        step, rest = divmod(tick, self.step_ms)
        if rest or step < first_step(self.config):
            return errors, PlanningOutputs()
        stance = horizon_stance(self.config, self.index, step)
        du, y = self.forces(errors, stance.astype(float)), np.tile(wanted, (len(stance), 1))
        u = nominal_forces(stance, self.config.robot.weight) + du
        plan = Plan(tick, tick * 10**6, step, u, y, "solved", {}, 0)
        return errors, PlanningOutputs(plan, ActivePlan(tick, tick, du, y))

    def forces(self, errors: Array, stance: Array) -> Array:
        z, vx, vy, roll, pitch, _ = errors
        each: Array = np.outer(np.ones(4), [-self.speed * vx, -self.speed * vy, -self.height * z])
        each[:, 2] += self.tilt * (pitch * FRONT - roll * LEFT)
        return (stance[..., None] * np.clip(each, -8.0, 8.0)).reshape(len(stance), 12)
