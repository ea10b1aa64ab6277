"""The central planner's core: when a step is due, of which samples it is made."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import numpy as np

from agents.central import Central, CentralOutputs, CentralState
from agents.gait import nominal_forces, scheduled_stance
from agents.planner.central import centralised
from agents.rehearsal import rehearse_central
from shared.config import Config, PlannerConfig, TeamConfig
from shared.messages import Measurement
from tests.agents.duet import asked, simple_predictor

CONFIG = Config(team=TeamConfig(robots=2), planner=PlannerConfig(kind="centralised"))
CENTRAL = Central(CONFIG, centralised(CONFIG, simple_predictor(CONFIG)))
ON_COURSE = np.array([0.26, 0.3, 0.0, 0.0, 0.0, 0.0])


def sample(name: str, tick: int, vx: float = 0.3) -> tuple[str, Measurement]:
    stance = scheduled_stance(CONFIG, int(name[1]) - 1, np.array([tick - 10]))[0]
    y = ON_COURSE.copy()
    y[1] = vx
    return name, Measurement(tick, 0, nominal_forces(stance), y, stance.astype(float))


def heard(until: int, vx: float = 0.3) -> CentralState:
    """All samples of both robots up to a tick."""
    state = CentralState()
    for tick in range(10, until + 1, 10):
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


def test_the_clock_is_only_told() -> None:
    ticking = iter(range(0, 1000, 7))
    timed = Central(CONFIG, centralised(CONFIG, simple_predictor(CONFIG)), lambda: next(ticking))
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

    rehearse_central(CONFIG, Watched(CONFIG, centralised(CONFIG, simple_predictor(CONFIG))))
    assert planned == [8, 8, 9, 9]
