"""Plans in force: which is applied at a tick, and what none may have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quadriga.agents.gait import horizon_stance, nominal_forces
from quadriga.agents.planning.active_plan import FARTHEST, PlanCheck, add_plan, setpoint_at
from quadriga.agents.planning.interface import ActivePlan
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.messages import Plan
from quadriga.shared.robots.conventions import Array
from tests.a1 import WEIGHT


@pytest.mark.parametrize(("latency_ms", "N", "applied"), [(80, 12, 4), (81, 12, 4), (0, 4, 4)])
def test_the_latest_permitted_plan_is_in_force_until_the_next(
    latency_ms: int, N: int, applied: int
) -> None:
    keys = {"planner.latency_ms": latency_ms, "planner.N": N, "planner.applied": applied}
    every, plan = 10 * applied, (np.ones((N, 12)), np.zeros((N, 6)))
    plans: tuple[ActivePlan, ...] = ()
    gaps = 0
    for tick in range(30 * every):
        if tick % every == 0:
            plans = add_plan(plans, ActivePlan(tick + latency_ms, tick, *plan))
        gaps += tick >= latency_ms and setpoint_at(plans, tick).y_ref is None
    if gaps:
        with pytest.raises(ConfigError, match=r"planner\.latency_ms"):
            load(None, keys)
    else:
        load(None, keys)


def plan_at(start: int, plan_tick: int, value: float, samples: int = 25) -> ActivePlan:
    deviation: Array = np.full((samples, 12), value) + np.arange(samples)[:, None] * 0.01
    return ActivePlan(start, plan_tick, deviation, np.full((samples, 6), value))


def test_a_plan_with_latency_takes_over_from_the_one_before_and_stays_aligned() -> None:
    plans: tuple[ActivePlan, ...] = ()
    seen: dict[int, float] = {}
    for tick in range(320, 480):
        if tick % 40 == 0:
            plans = add_plan(plans, plan_at(tick + 16, tick, float(tick // 40)))
        seen[tick] = float(setpoint_at(plans, tick).deviation[0])
    assert seen[335] == 0.0
    assert seen[336] == pytest.approx(8.01)  # its second sample: the first is over
    assert seen[375] == pytest.approx(8.05)
    assert seen[376] == pytest.approx(9.01)
    assert len(plans) <= 3
    last = plans[-1]
    np.testing.assert_array_equal(setpoint_at(plans, 689).y_ref, last.outputs[24])
    assert setpoint_at(plans, 690).y_ref is None


STEP, CONFIG = 20, Config()
NOMINAL = nominal_forces(horizon_stance(CONFIG, 0, STEP), WEIGHT)
STANDS = np.repeat(horizon_stance(CONFIG, 0, STEP), 3, axis=1)
SIDEWAYS: Array = np.where(STANDS, np.tile([18.0, 18.0, -59.0], 4), 0.0)


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({}, ""),
        ({"u": NOMINAL[:5]}, "forces that are not an array of 25x12 float64"),
        ({"y": np.zeros((25, 6), dtype=np.float32)}, "outputs that are not an array"),
        ({"u": NOMINAL * np.nan}, "forces that are not finite"),
        ({"y": np.full((25, 6), np.inf)}, "outputs that are not finite"),
        ({"y": np.full((25, 6), FARTHEST)}, ""),
        ({"y": np.full((25, 6), -1.1 * FARTHEST)}, "outputs beyond 10"),
        ({"u": NOMINAL + 15.0 * ~STANDS}, "forces of a leg that swings"),
        ({"u": NOMINAL + 100.0 * STANDS}, "forces that deviate by more"),
        ({"u": NOMINAL + SIDEWAYS}, "forces outside the friction cone"),
        ({"tick": 40 * STEP + 10}, "a tick that is not that of its step"),
        ({"tick": 40 * STEP + 80, "step": STEP + 2}, "samples of another time"),
        ({"tick": 0, "step": 0}, "samples of another time"),
    ],
)
def test_each_fault_of_a_plan_is_named(change: dict[str, object], fault: str) -> None:
    good = Plan(40 * STEP, 0, STEP, NOMINAL, np.zeros((25, 6)), "solved", {}, 0)
    plan, check = replace(good, **change), PlanCheck(CONFIG, 0)  # type: ignore[arg-type]
    found = check.fault_of(plan, 40 * STEP)
    assert found.startswith(fault)
    assert bool(found) == bool(fault)
    if plan.tick == good.tick and plan.u.shape == NOMINAL.shape:
        active = ActivePlan(40 * STEP, plan.tick, plan.u - NOMINAL, plan.y)
        assert check.fault_of_active(active, 40 * STEP) == found
        assert check.fault_of_active(active, 40 * STEP + 1) == "a start that is over"
