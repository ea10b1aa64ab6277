"""An agent that follows a central planner: takes its plans into force, fades them, misses them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from quadriga.agents.gait import horizon_stance
from quadriga.agents.planning.interface import Expected, PlanningInputs, PlanningOutputs
from quadriga.agents.planning.remote import RemotePlanning
from quadriga.shared.config.sections import Config, PlannerConfig, TeamConfig
from quadriga.shared.config.timing import max_ages
from quadriga.shared.messages import Measurement, Plan
from quadriga.shared.modes import STAND, WALK, Mode
from quadriga.shared.robots.conventions import Array
from tests.a1 import nominal_forces
from tests.agents.duet import Planned, asked

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


class Follower(Planned):
    def __init__(self, config: Config = CONFIG) -> None:
        super().__init__(config, 1, RemotePlanning(config, 1))

    def follow(
        self, tick: int, *plans: Plan, y: Array = ON_COURSE, mode: Mode = WALKING
    ) -> PlanningOutputs:
        arrived = tuple(("planner", plan) for plan in plans)
        sample = Measurement(tick, 0, np.zeros(12), y, np.ones(4))
        return self.step(PlanningInputs(tick, mode, (REFERENCE,), sample, (), arrived))

    def force(self, tick: int) -> float:
        """The largest of the force deviations that are applied at a tick."""
        return float(self.applied(tick).deviation.max())


def test_a_plan_is_in_force_from_its_arrival_on_and_aligned_with_its_own_time() -> None:
    follower = Follower()
    follower.follow(320)
    assert follower.force(320) == 0.0
    follower.follow(323, plan_of(8))
    assert follower.force(323) == pytest.approx(8.0)
    later = follower.follow(355)
    assert follower.force(355) == pytest.approx(8.03)
    assert (later.plan, later.planner_ns) == (None, None)


def test_lock_step_awaits_a_plan_its_latency_after_its_data() -> None:
    assert Follower().planning.expected(321) == Expected(plan=(8, 0))
    assert Follower().planning.expected(320) == Expected()
    late = Follower(replace(CONFIG, planner=replace(CONFIG.planner, latency_ms=16))).planning
    assert [t for t in range(300, 420) if late.expected(t).plan] == [336, 376, 416]


def test_older_and_repeated_plans_and_those_of_another_horizon_are_passed_over() -> None:
    follower = Follower()
    follower.follow(361, plan_of(9))
    short = replace(plan_of(10), u=np.zeros((5, 12)))
    for stale in (plan_of(8), plan_of(9), short):
        follower.follow(362, stale)
        assert follower.force(362) == pytest.approx(9.0)


@pytest.mark.parametrize(
    "change",
    [{"tick": 400, "step": 10}, {"tick": 0, "step": 0}, {"u": np.full((N, 12), 1e4)},
     {"y": np.full((N, 6), -1e308)}],
)  # fmt: skip
def test_a_plan_that_cannot_be_meant_is_not_used_and_blocks_none(change: dict[str, Any]) -> None:
    follower = Follower()
    assert follower.follow(365, replace(plan_of(8), **change)).unusual == ("refused_by_planner",)
    assert follower.force(365) == 0.0
    assert follower.follow(366, plan_of(9)).unusual == ()
    assert follower.force(366) == pytest.approx(9.0)


@pytest.mark.parametrize("largest", [(20.0, 20.0, 60.0), (0.0, 0.0, 0.0)])
def test_a_plan_at_the_bounds_of_its_planner_is_used(largest: tuple[float, ...]) -> None:
    config = replace(CONFIG, planner=replace(CONFIG.planner, deviation_max=largest))
    stance = horizon_stance(config, 1, 9)
    du = np.repeat(stance, 3, axis=1) * np.tile(np.multiply(largest, (-1.0, -1.0, 1.0)), 4)
    full = replace(plan_of(9), u=nominal_forces(stance) + (1.0 + 1e-6) * du)
    follower = Follower(config)
    assert follower.follow(365, full).unusual == ()
    assert follower.state.newest == (9, 0)


def test_a_plan_fades_out_beyond_the_range_of_the_data_and_follows_what_is_asked_for() -> None:
    faster = plan_of(8)
    faster = replace(faster, y=faster.y + np.array([0.0, 0.2, 0.1, 0.0, 0.0, 0.0]))
    off = np.array([0.0, CONFIG.planner.trust_range[1], 0.0, 0.0, 0.0, 0.0])
    for times, share in ((0.0, 1.0), (1.5, 0.5), (2.0, 0.0)):
        follower = Follower()
        outputs = follower.follow(321, faster, y=ON_COURSE + times * off)
        assert follower.force(321) == pytest.approx(8.0 * share)
        assert outputs.unusual == (() if share == 1.0 else ("plan_faded",))
        y_ref = follower.applied(321).y_ref
        assert y_ref is not None
        np.testing.assert_allclose(y_ref[1:3], [0.3 + 0.2 * share, 0.1 * share], atol=1e-12)


def test_no_plan_is_used_that_is_older_than_check_allows() -> None:
    late = replace(CONFIG, planner=replace(CONFIG.planner, latency_ms=16))
    follower, limit = Follower(late), max_ages(late)["plan"]
    follower.follow(336, plan_of(8))
    assert follower.follow(320 + limit - 1).stop_reason == ""
    assert follower.follow(320 + limit).stop_reason == "planner-lost"


def test_without_plans_the_robot_stops_with_a_name_for_it() -> None:
    """And each tick tells the age of the plan in use."""
    follower, planner = Follower(), CONFIG.planner
    assert follower.follow(321, plan_of(8)).stop_reason == ""
    reasons = {}
    for step in range(9, 25):
        outputs = follower.follow(tick := 40 * step + 1)
        reasons[step] = outputs.stop_reason
        assert outputs.ages_ms == {"plan": tick - 320.0}
        if step - 8 >= planner.N // planner.applied + 1:
            assert follower.force(tick) == 0.0, "a plan that has run out says nothing"
    patience = planner.max_peer_age + planner.hold_steps
    assert next(step for step, why in reasons.items() if why) == 8 + patience + 1
    assert {*reasons.values()} == {"", "planner-lost"}


def test_nothing_is_applied_unless_walking() -> None:
    follower = Follower()
    follower.follow(321, plan_of(8), mode=Mode(STAND, 0))
    assert follower.force(321) == 0.0
