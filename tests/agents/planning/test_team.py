"""The central planner's core: when a step is due, of which samples it is made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import permutations
from typing import cast

import numpy as np
import pytest

from quadriga.agents.gait import scheduled_stance
from quadriga.agents.planner.planner import PlannerInputs
from quadriga.agents.planner.team_planner import TeamPlanner, TeamResult, build_centralised
from quadriga.agents.planning.reference_slew import ReferenceSlew
from quadriga.agents.planning.team import Central, CentralOutputs, CentralState
from quadriga.agents.rehearsal import rehearse_central
from quadriga.identification.rollout import Rollout
from quadriga.shared.codec import encode
from quadriga.shared.config.sections import Config, PlannerConfig, TeamConfig
from quadriga.shared.messages import Measurement, Reference
from quadriga.shared.modes import PASSIVE, STOPPING, Mode
from quadriga.shared.robots.conventions import Array
from tests.a1 import nominal_forces
from tests.agents.duet import asked, every_100_ms, fingerprint, simple_predictor

CONFIG = Config(team=TeamConfig(robots=2), planner=PlannerConfig(kind="centralised"))
CENTRAL = Central(CONFIG, build_centralised(CONFIG, simple_predictor(CONFIG)))
ON_COURSE = np.array([0.26, 0.3, 0.0, 0.0, 0.0, 0.0])


def sample(name: str, tick: int, vx: float = 0.3) -> tuple[str, Measurement]:
    stance = scheduled_stance(CONFIG, int(name[1]) - 1, np.array([tick - 10]))[0]
    y = ON_COURSE.copy()
    y[1] = vx
    return name, Measurement(tick, 0, nominal_forces(stance), y, stance.astype(float))


def standing(name: str, tick: int) -> tuple[str, Measurement]:
    """What a robot measures that has stopped, or is damped."""
    return name, replace(sample(name, tick)[1], stance=np.ones(4))


def heard(until: int, vx: float = 0.3, start: CentralState | None = None) -> CentralState:
    """All samples of both robots up to a tick, after those in `start`."""
    state, first = start or CentralState(), 10
    if state.windows:
        first = 10 + max(held[-1].tick for held in state.windows.values())
    for tick in range(first, until + 1, 10):
        pair = [sample("r1", tick, vx), sample("r2", tick)]
        state = CENTRAL.remember(state, pair, [asked(0.3)])
    return state


def test_the_first_step_is_due_when_all_walk_and_all_windows_are_whole() -> None:
    assert CENTRAL.due(heard(310)) is None
    assert CENTRAL.due(heard(320)) == 8
    late = CENTRAL.remember(heard(310), [sample("r1", 320)], ())
    assert CENTRAL.due(late) is None
    assert CENTRAL.due(CENTRAL.remember(late, [sample("r2", 320)], ())) == 8


def test_each_robot_gets_its_own_plan_once() -> None:
    state, outputs = CENTRAL.step(heard(320, vx=0.2))
    assert [name for name, _ in outputs.plans] == ["r1", "r2"]
    slow, right = (plan for _, plan in outputs.plans)
    assert (slow.step, slow.tick, slow.status) == (8, 320, "solved")
    assert slow.used == {"r1": 8, "r2": 8}
    pushes = [
        (plan.u - nominal_forces(scheduled_stance(CONFIG, i, 320 + 10 * np.arange(25))))[:4, ::3]
        for i, plan in enumerate((slow, right))
    ]
    assert pushes[0].sum() > 10.0
    assert np.abs(pushes[1]).max() < 1e-6
    assert CENTRAL.step(state)[1].plans == ()


def test_a_lost_sample_delays_the_plan_until_the_window_is_whole_again() -> None:
    state = heard(320)
    for tick in range(330, 500, 10):
        both = [sample("r1", tick)] + ([sample("r2", tick)] if tick != 350 else [])
        state = CENTRAL.remember(state, both, ())
        if tick in (360, 400, 440):
            assert CENTRAL.due(state) is None or tick == 440
    assert CENTRAL.due(state) == 12


def test_the_order_of_arrival_does_not_matter_and_strangers_do_not_count() -> None:
    news = [sample("r1", 320), sample("r2", 320), ("r7", sample("r1", 320)[1]), sample("r1", 100)]
    results = set()
    for order in permutations(news):
        _, outputs = CENTRAL.step(CENTRAL.remember(heard(310), order, ()))
        results.add(b"".join(plan.u.tobytes() for _, plan in outputs.plans))
    assert len(results) == 1


@pytest.mark.parametrize(
    ("u", "refused"), [(np.full((25, 12), np.nan), ["r2"]), (np.zeros((7, 12)), ["r1", "r2"])]
)
def test_a_plan_that_cannot_be_meant_is_refused_for_its_robot_by_name(
    u: Array, refused: list[str]
) -> None:
    class Faulty:
        def step(self, inputs: Sequence[PlannerInputs]) -> TeamResult:
            result = CENTRAL._planner.step(inputs)
            return replace(result, u=np.stack([result.u[0], u]) if len(u) == 25 else u)

    central = Central(CONFIG, cast("TeamPlanner", Faulty()))
    (_, expected), (_, found) = CENTRAL.step(heard(320)), central.step(heard(320))
    assert found.unusual == ("refused_plan_of_centralised",) * len(refused)
    for (name, plan), (_, right) in zip(found.plans, expected.plans, strict=True):
        if name not in refused:
            assert encode(plan) == encode(right)
            continue
        stance = scheduled_stance(CONFIG, int(name[1]) - 1, 320 + 10 * np.arange(25))
        np.testing.assert_array_equal(plan.u, nominal_forces(stance))
        np.testing.assert_array_equal(plan.y, np.tile(ON_COURSE, (25, 1)))
        assert plan.status.startswith("nominal:plan of centralised refused: forces")


def test_the_clock_is_only_told() -> None:
    ticking = iter(range(0, 1000, 7))
    timed = Central(
        CONFIG, build_centralised(CONFIG, simple_predictor(CONFIG)), lambda: next(ticking)
    )
    _, outputs = timed.step(heard(320))
    _, untimed = CENTRAL.step(heard(320))
    assert (outputs.planner_ns, untimed.planner_ns) == (7, 0)
    assert outputs.plans[0][1].u.tobytes() == untimed.plans[0][1].u.tobytes()
    assert replace(outputs, planner_ns=0).plans[0][1].used == untimed.plans[0][1].used


def test_a_rehearsal_plans_two_steps_of_standing() -> None:
    planned: list[int] = []

    class Watched(Central):
        def step(self, state: CentralState) -> tuple[CentralState, CentralOutputs]:
            after, outputs = super().step(state)
            planned.extend(plan.step for _, plan in outputs.plans)
            return after, outputs

    rehearse_central(CONFIG, Watched(CONFIG, build_centralised(CONFIG, simple_predictor(CONFIG))))
    assert planned == [8, 8, 9, 9]


@pytest.mark.parametrize("name", ["r1", "r2"])
@pytest.mark.parametrize("ahead", [210, 1000, 10**12])
def test_a_sample_of_a_time_far_ahead_is_refused_and_makes_none_late(name: str, ahead: int) -> None:
    _, forged = sample(name, 0)
    state = CENTRAL.remember(heard(350), [(name, replace(forged, tick=350 + ahead))], ())
    assert state.refused == 1
    state = heard(360, start=state)
    assert CENTRAL.due(state) == 9
    made, usual = (CENTRAL.step(which)[1] for which in (state, heard(360)))
    assert fingerprint(made) == fingerprint(usual)
    assert heard(370, start=state).refused == 1


def test_a_reference_that_jumps_is_approached_as_agents_do() -> None:
    slew, state, given = ReferenceSlew(CONFIG), CentralState(), list[Reference]()
    for k in range(4):
        asked = Reference(100 * k, 0, 1.2 * (-1) ** k, 0.0, 0.0, 0.26)
        given.append(slew.limit(asked))
        state = CENTRAL.remember(state, (), [asked])
    assert state.references == tuple(given)
    assert given[1].vx > 0.0


@pytest.mark.parametrize("robots", [1, 2, 3, 4])
def test_after_a_silence_of_all_the_team_plans_again(robots: int) -> None:
    config = replace(CONFIG, team=TeamConfig(robots=robots))
    central = Central(config, build_centralised(config, simple_predictor(config)))
    state, names = CentralState(), [f"r{k + 1}" for k in range(robots)]
    for tick in (*range(10, 350, 10), *range(5000, 5400, 10)):
        state = central.remember(state, [sample(name, tick) for name in names], ())
    assert 0 < state.refused < 2 * robots
    assert central.due(state) == 5390 // 40


def test_a_third_robot_that_claims_another_time_stops_nobody_else() -> None:
    config = replace(CONFIG, team=TeamConfig(robots=3))
    central, state = (
        Central(config, build_centralised(config, simple_predictor(config))),
        CentralState(),
    )
    for tick in range(10, 600, 10):
        both = [sample("r1", tick), sample("r2", tick)]
        wrong = sample("r3", 10**6 + tick if tick > 300 else tick)
        state = central.remember(state, [wrong, *both], ())
    assert [held[-1].tick for _, held in sorted(state.windows.items())] == [590, 590, 300]


def test_references_of_a_time_far_ahead_are_refused() -> None:
    ahead = [replace(asked(), tick=tick) for tick in (400, 1350, 1351, 1 << 41)]
    state = CENTRAL.remember(heard(350), (), ahead)
    assert [reference.tick for reference in state.references] == [0, 400, 1350]
    assert state.refused == 2


@pytest.mark.parametrize("name", ["r1", "r2"])
def test_nobody_is_planned_for_once_a_robot_stands_where_it_should_walk(name: str) -> None:
    other = "r2" if name == "r1" else "r1"
    state = heard(350)
    assert CENTRAL.due(state) == 8
    for tick in range(360, 700, 10):
        state = CENTRAL.remember(state, [standing(name, tick), sample(other, tick)], ())
        if tick % 40 == 0:
            assert CENTRAL.due(state) is None
            assert CENTRAL.step(state)[1] == CentralOutputs()


def test_the_stand_before_the_first_step_is_none() -> None:
    config = replace(CONFIG, gait=replace(CONFIG.gait, stand_ms=320))
    central = Central(config, build_centralised(config, simple_predictor(config)))
    state = CentralState()
    for tick in range(10, 330, 10):
        pair = [standing("r1", tick), standing("r2", tick)]
        state = central.remember(state, pair, ())
    assert central.due(state) == 8


@pytest.mark.parametrize("mode", [Mode(PASSIVE, 400, "fall"), Mode(STOPPING, 400, "peer")])
def test_when_one_robot_has_stopped_the_other_does_not_go_on(mode: Mode) -> None:
    config = replace(CONFIG, planner=replace(CONFIG.planner, latency_ms=0))
    planner = build_centralised(config, simple_predictor(config))
    rollout = Rollout(config, None, every_100_ms, planner=planner)
    for _ in range(400):
        before = rollout.step().outputs["r2"]
    assert before.mode == "walk"
    rollout.states["r1"] = replace(rollout.states["r1"], mode=mode)
    for _ in range(1400):
        outputs = rollout.step().outputs["r2"]
        if outputs.mode != "walk":
            break
    assert (outputs.mode, outputs.reason) == ("stopping", "planner-lost")


@pytest.mark.parametrize("force", [1e300, -1200.0])
def test_a_sample_of_forces_that_no_leg_can_carry_is_refused(force: float) -> None:
    name, good = sample("r2", 320)
    forged = name, replace(good, u=np.full(12, force))
    state = CENTRAL.remember(heard(310), [forged, sample("r1", 320), (name, good)], ())
    assert state.refused == 1
    assert CENTRAL.due(state) == 8, "the robot's own still counts"
