"""An agent that follows a central planner: takes its plans into force, fades them, misses them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from quadriga.agents.gait import horizon_stance
from quadriga.agents.planning.active_plan import setpoint_at
from quadriga.agents.planning.interface import Expected, PlanningInputs, PlanningOutputs
from quadriga.agents.planning.registry import CheckedPlanning, PlanningState
from quadriga.agents.planning.remote import RemotePlanning
from quadriga.shared.config.sections import Config, PlannerConfig, TeamConfig
from quadriga.shared.config.timing import max_ages
from quadriga.shared.messages import Measurement, Plan
from quadriga.shared.modes import STAND, WALK, Mode
from quadriga.shared.robots.conventions import Array
from tests.a1 import nominal_forces
from tests.agents.duet import asked

CONFIG = Config(team=TeamConfig(robots=2), planner=PlannerConfig(kind="centralised", latency_ms=0))
WALKING, REFERENCE = Mode(WALK, 300), asked(0.3)
ON_COURSE = np.array([0.26, 0.3, 0.0, 0.0, 0.0, 0.0])
N = CONFIG.planner.N


def plan_of(step: int, *, exchange: int = 0) -> Plan:
    """Sample k of the plan of step s deviates by s + k/100 N."""
    stance = horizon_stance(CONFIG, 1, step)
    du = (step + 0.01 * np.arange(N))[:, None] * np.repeat(stance, 3, axis=1)
    u = nominal_forces(stance) + du
    return Plan(40 * step, 0, step, u, np.tile(ON_COURSE, (N, 1)), "solved", {}, exchange)


def sample_at(tick: int, y: Array = ON_COURSE) -> Measurement:
    return Measurement(tick, 0, np.zeros(12), y, np.ones(4))


def follower_of(config: Config = CONFIG) -> CheckedPlanning:
    return CheckedPlanning(config, 1, RemotePlanning(config, 1))


NOTHING_YET = follower_of().initial()


def applied(state: PlanningState, tick: int) -> Array:
    """The force deviations that a state has applied at a tick."""
    return setpoint_at(state.plans, tick).deviation


def follow(
    follower: CheckedPlanning,
    state: PlanningState,
    tick: int,
    *plans: Plan,
    y: Array = ON_COURSE,
    mode: Mode = WALKING,
) -> tuple[PlanningState, PlanningOutputs]:
    arrived = PlanningInputs(
        tick, mode, (REFERENCE,), sample_at(tick, y), (), tuple(("planner", p) for p in plans)
    )
    return follower.step(state, arrived)


def test_a_plan_is_in_force_from_its_arrival_on_and_aligned_with_its_own_time() -> None:
    follower = follower_of()
    state, _ = follow(follower, NOTHING_YET, 320)
    assert not applied(state, 320).any()
    state, _ = follow(follower, state, 323, plan_of(8))
    assert applied(state, 323).max() == pytest.approx(8.0)
    state, later = follow(follower, state, 320 + 35)
    assert applied(state, 355).max() == pytest.approx(8.03)
    assert later.plan is None
    assert later.planner_ns is None


def test_lock_step_awaits_a_plan_its_latency_after_its_data() -> None:
    assert follower_of().expected(321) == Expected(plan=(8, 0))
    assert follower_of().expected(320) == Expected()
    late = replace(CONFIG, planner=replace(CONFIG.planner, latency_ms=16))
    assert [t for t in range(300, 420) if follower_of(late).expected(t).plan] == [336, 376, 416]


def test_older_and_repeated_plans_and_those_of_another_horizon_are_passed_over() -> None:
    follower = follower_of()
    state, _ = follow(follower, NOTHING_YET, 361, plan_of(9))
    short = replace(plan_of(10), u=np.zeros((5, 12)))
    for stale in (plan_of(8), plan_of(9), short):
        state, _ = follow(follower, state, 362, stale)
        assert applied(state, 362).max() == pytest.approx(9.0)


@pytest.mark.parametrize(
    "change",
    [{"tick": 400, "step": 10}, {"tick": 0, "step": 0}, {"u": np.full((N, 12), 1e4)},
     {"y": np.full((N, 6), -1e308)}],
)  # fmt: skip
def test_a_plan_that_cannot_be_meant_is_not_used_and_blocks_none(change: dict[str, Any]) -> None:
    follower = follower_of()
    state, outputs = follow(follower, NOTHING_YET, 365, replace(plan_of(8), **change))
    assert not applied(state, 365).any()
    assert outputs.unusual == ("refused_by_planner",)
    state, outputs = follow(follower, state, 366, plan_of(9))
    assert applied(state, 366).max() == pytest.approx(9.0)
    assert outputs.unusual == ()


@pytest.mark.parametrize("largest", [(20.0, 20.0, 60.0), (0.0, 0.0, 0.0)])
def test_a_plan_at_the_bounds_of_its_planner_is_used(largest: tuple[float, ...]) -> None:
    config = replace(CONFIG, planner=replace(CONFIG.planner, deviation_max=largest))
    stance = horizon_stance(config, 1, 9)
    du = np.repeat(stance, 3, axis=1) * np.tile(np.multiply(largest, (-1.0, -1.0, 1.0)), 4)
    full = replace(plan_of(9), u=nominal_forces(stance) + (1.0 + 1e-6) * du)
    state, outputs = follow(follower_of(config), NOTHING_YET, 365, full)
    assert outputs.unusual == ()
    assert state.planner.newest == (9, 0)


def test_the_age_of_the_plan_in_use_is_told_at_every_tick() -> None:
    follower = follower_of()
    state, _ = follow(follower, NOTHING_YET, 321, plan_of(8))
    for tick in (330, 401, 600):
        assert follow(follower, state, tick)[1].ages_ms == {"plan": tick - 320.0}


def test_a_plan_fades_out_beyond_the_range_of_the_data_and_follows_what_is_asked_for() -> None:
    follower, faster = follower_of(), plan_of(8)
    faster = replace(faster, y=faster.y + np.array([0.0, 0.2, 0.1, 0.0, 0.0, 0.0]))
    off = np.array([0.0, CONFIG.planner.trust_range[1], 0.0, 0.0, 0.0, 0.0])
    for times, share in ((0.0, 1.0), (1.5, 0.5), (2.0, 0.0)):
        state, outputs = follow(follower, NOTHING_YET, 321, faster, y=ON_COURSE + times * off)
        assert applied(state, 321).max() == pytest.approx(8.0 * share)
        assert outputs.unusual == (() if share == 1.0 else ("plan_faded",))
        y_ref = setpoint_at(state.plans, 321).y_ref
        assert y_ref is not None
        np.testing.assert_allclose(y_ref[1:3], [0.3 + 0.2 * share, 0.1 * share], atol=1e-12)


def test_no_plan_is_used_that_is_older_than_check_allows() -> None:
    late = replace(CONFIG, planner=replace(CONFIG.planner, latency_ms=16))
    follower, limit = follower_of(late), max_ages(late)["plan"]
    state, _ = follow(follower, NOTHING_YET, 336, plan_of(8))
    _, used = follow(follower, state, 320 + limit - 1)
    _, given_up = follow(follower, state, 320 + limit)
    assert (used.stop_reason, given_up.stop_reason) == ("", "planner-lost")


def test_without_plans_the_robot_stops_with_a_name_for_it() -> None:
    follower, planner = follower_of(), CONFIG.planner
    state, outputs = follow(follower, NOTHING_YET, 321, plan_of(8))
    assert outputs.stop_reason == ""
    reasons = {}
    for step in range(9, 25):
        state, outputs = follow(follower, state, 40 * step + 1)
        reasons[step] = outputs.stop_reason
        if step - 8 >= planner.N // planner.applied + 1:
            assert not applied(state, 40 * step + 1).any(), "a plan that has run out says nothing"
    patience = planner.max_peer_age + planner.hold_steps
    assert next(step for step, why in reasons.items() if why) == 8 + patience + 1
    assert set(reasons.values()) == {"", "planner-lost"}


def test_nothing_is_applied_unless_walking() -> None:
    state, _ = follow(follower_of(), NOTHING_YET, 321, plan_of(8), mode=Mode(STAND, 0))
    assert not applied(state, 321).any()
