"""The central planner's core: when a step is due, of which samples it is made."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from quadriga.agents.gait import scheduled_stance
from quadriga.agents.planner.team import build_centralised
from quadriga.agents.planning.central import Central, CentralOutputs, CentralState
from quadriga.agents.rehearsal import rehearse_central
from quadriga.identification.rollout import Rollout
from quadriga.shared.config.sections import Config, PlannerConfig, TeamConfig
from quadriga.shared.messages import Measurement
from quadriga.shared.modes import PASSIVE, STOPPING, Mode
from tests.a1 import nominal_forces
from tests.agents.duet import asked, every_100_ms, simple_predictor

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
