"""What every planner must keep to, whoever wrote it: held against a walk of two robots."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from quadriga.agents.gait import first_step, horizon_stance, nominal_forces, step_ms
from quadriga.agents.planning.active_plan import PlanCheck, setpoint_at
from quadriga.agents.planning.interface import (
    ActivePlan,
    Expected,
    PlanningInputs,
    PlanningInterface,
    PlanningOutputs,
)
from quadriga.agents.planning.registry import build_planning
from quadriga.agents.predictor.predictor import Predictor
from quadriga.experiments.trial.sample_trials import sample_predictor
from quadriga.identification.central_planner import choose_central_planner
from quadriga.identification.rollout import Rollout
from quadriga.identification.sample_fits import linear_episode
from quadriga.shared.codec import decode, encode
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.members import PLANNER
from quadriga.shared.messages import Plan
from quadriga.shared.modes import STAND, WALK, Mode
from quadriga.shared.planner_kinds import find_kind, installed_kinds
from quadriga.shared.robots.conventions import Array, robot_names
from quadriga.team.operator import references_of
from tests.agents.duet import fingerprint
from tests.plugins.kinds import install_kind

TICKS = 600
KEYS = {
    "team.robots": 2,
    "gait.stand_ms": 100,
    "reference.vx": 0.3,
    "reference.ramp": 0.1,
    "planner.N": 10,
    "planner.T_ini": 4,
    "world.seed": 5,
    "world.scatter": 0.02,
}

every_kind = pytest.mark.parametrize("name", installed_kinds())


@dataclass(frozen=True)
class Call:
    """A step of a planning part: copies of its arguments, and what it gave."""

    before: Any
    inputs: PlanningInputs
    after: Any
    outputs: PlanningOutputs


class Watched(PlanningInterface[Any]):
    """A planning part whose steps are kept."""

    def __init__(self, planning: PlanningInterface[Any]) -> None:
        self.planning = planning
        self.calls: list[Call] = []

    @property
    def peers(self) -> tuple[str, ...]:
        return self.planning.peers

    def initial(self) -> Any:
        return self.planning.initial()

    def expected(self, tick: int) -> Expected:
        return self.planning.expected(tick)

    def step(self, state: Any, inputs: PlanningInputs) -> tuple[Any, PlanningOutputs]:
        before, arrived = deepcopy(state), deepcopy(inputs)
        after, outputs = self.planning.step(state, inputs)
        assert fingerprint(before) == fingerprint(state), "a step changed the state it was given"
        assert fingerprint(arrived) == fingerprint(inputs), "a step changed its inputs"
        self.calls.append(Call(before, arrived, deepcopy(after), deepcopy(outputs)))
        return after, outputs


def config_of(name: str) -> Config:
    return load(None, {**KEYS, "planner.kind": name})


def predictor_of(config: Config) -> Predictor | None:
    kind = find_kind(config.planner.kind)
    return sample_predictor(config) if kind.needs_predictor else None


def build(config: Config, index: int) -> PlanningInterface[Any]:
    predictor = predictor_of(config) if find_kind(config.planner.kind).agents_predict else None
    return build_planning(config, index, predictor, lambda: 0)


@cache
def walk(name: str) -> tuple[list[Call], ...]:
    """The steps of both robots' planning parts in a walk."""
    config, kind = config_of(name), find_kind(name)
    predictor = predictor_of(config)
    team = None
    if kind.central:
        episodes = [linear_episode(config, 300, seed) for seed in range(2)]
        team = choose_central_planner(config, predictor, lambda: episodes)
    of_agents = predictor if kind.agents_predict else None
    rollout = Rollout(config, of_agents, references_of(config), planner=team)
    watched = [Watched(build(config, index)) for index in range(2)]
    for agent, planning in zip(rollout.agents.values(), watched, strict=True):
        agent._planning = cast("Any", planning)
    for _ in rollout.ticks(TICKS):
        pass
    assert not rollout.world.fallen()
    return tuple(planning.calls for planning in watched)


def plans_of(name: str, robot: int) -> list[Plan]:
    """The plans that a robot made, or was sent by the planner of the whole team."""
    calls = walk(name)[robot]
    if find_kind(name).central:
        return [plan for call in calls for sender, plan in call.inputs.plans if sender == PLANNER]
    return [call.outputs.plan for call in calls if call.outputs.plan is not None]


@every_kind
@pytest.mark.parametrize("robot", [0, 1])
def test_the_robot_walks_and_plans_and_setpoints_are_finite(name: str, robot: int) -> None:
    config, plans = config_of(name), plans_of(name, robot)
    assert bool(plans) is find_kind(name).publishes
    for plan in plans:
        assert plan.u.shape == (config.planner.N, 12)
        assert plan.y.shape == (config.planner.N, 6)
        assert np.isfinite(plan.u).all()
        assert np.isfinite(plan.y).all()
        assert plan.tick == plan.step * step_ms(config)
    assert [plan.serial for plan in plans] == sorted({plan.serial for plan in plans})
    calls = walk(name)[robot]
    assert (len(calls), calls[-1].inputs.mode.name) == (TICKS, WALK)
    assert {call.outputs.stop_reason for call in calls} == {""}
    check, active = PlanCheck(config, robot), tuple[ActivePlan, ...]()
    for call in calls:
        outputs, active = check.admit(call.outputs, call.inputs, active)
        assert outputs is call.outputs, "none of its plans is refused"
        setpoint = setpoint_at(active, call.inputs.tick)
        assert setpoint.deviation.shape == (12,)
        assert np.isfinite(setpoint.deviation).all()
        assert setpoint.y_ref is None or np.isfinite(setpoint.y_ref).all()


@every_kind
@pytest.mark.parametrize("robot", [0, 1])
def test_a_replay_is_exact(name: str, robot: int) -> None:
    """Steps asked for in any order, too, give the same: nothing is kept but in the state."""
    planning = build(config_of(name), robot)
    assert fingerprint(planning.initial()) == fingerprint(walk(name)[robot][0].before)
    for call in reversed(walk(name)[robot]):
        after, outputs = planning.step(deepcopy(call.before), deepcopy(call.inputs))
        assert fingerprint(after) == fingerprint(call.after)
        assert fingerprint(outputs) == fingerprint(call.outputs)


@every_kind
def test_there_is_no_state_without_input(name: str) -> None:
    planning = build(config_of(name), 0)
    begin = planning.initial()
    assert fingerprint(begin) == fingerprint(planning.initial())
    for tick in range(50):
        state, outputs = planning.step(begin, PlanningInputs(tick, Mode(STAND, 0), ()))
        assert fingerprint(state) == fingerprint(begin)
        assert outputs.plan is None
        assert outputs.stop_reason == ""
        assert outputs.active is None


@every_kind
@pytest.mark.parametrize("robot", [0, 1])
def test_what_is_expected_can_have_been_sent(name: str, robot: int) -> None:
    config, kind = config_of(name), find_kind(name)
    planning, names = build(config, robot), robot_names(2)
    assert {*planning.peers} <= {*names} - {names[robot]}
    assert kind.needs_peers or not planning.peers
    for tick in range(TICKS):
        expected = planning.expected(tick)
        assert expected == planning.expected(tick)
        assert expected.reference_tick is None
        assert not expected.truth
        if expected.plan is not None:
            assert kind.central or planning.peers
            assert expected.plan[0] * step_ms(config) < tick
        if expected.measurement_tick is not None:
            assert planning.peers
            assert expected.measurement_tick < tick
    for plan in plans_of(name, robot):
        assert kind.central or {*plan.used} <= {*planning.peers}


Planned = tuple[Array, Array, Array, int]  # forces, their deviation, outputs, tick
# Of what is published, followed, or both; `tests/agents/planning/test_active_plan.py` has them all.
FAULTS: dict[str, Callable[[Array, Array, Array, int], Planned]] = {
    "forces that are not an array of 10x12 float64": (
        lambda u, du, y, t: (u[:, :6], du[:, :6], y, t)
    ),
    "forces that are not finite": lambda u, du, y, t: (u, du * np.nan, y, t),
    "outputs beyond 10 m or m/s or rad or rad/s": lambda u, du, y, t: (u, du, y + 11.0, t),
    "samples of another time": lambda u, du, y, t: (u, du, y, t - 400),
}


class Faulty(PlanningInterface[None]):
    """Plans nominal forces, with a fault."""

    def __init__(self, config: Config, index: int, *_: object) -> None:
        self.config, self.index = config, index
        self.fault = [*FAULTS.values()][int(config.planner.option_values["fault"])]

    def initial(self) -> None:
        return None

    def step(self, state: None, inputs: PlanningInputs) -> tuple[None, PlanningOutputs]:
        step, rest = divmod(inputs.tick, step_ms(self.config))
        if rest or inputs.mode.name != WALK or step < first_step(self.config):
            return None, PlanningOutputs()
        stance = horizon_stance(self.config, self.index, step)
        u = nominal_forces(stance, self.config.robot.weight)
        y = np.tile([0.26, 0.3, 0.0, 0.0, 0.0, 0.0], (len(u), 1))
        u, du, y, tick = self.fault(u, np.zeros_like(u), y, inputs.tick)
        plan = Plan(tick, tick * 10**6, tick // step_ms(self.config), u, y, "solved", {}, 0)
        return None, PlanningOutputs(plan, ActivePlan(inputs.tick, tick, du, y))


@pytest.mark.parametrize("fault", FAULTS)
def test_a_plan_that_cannot_be_meant_is_refused_by_name_and_the_robot_walks_on(
    fault: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    build = "build='tests.plugins.test_contract:Faulty', needs_predictor=False"
    install_kind(tmp_path, monkeypatch, "faulty", f"{build}, options={{'fault': 0}}")
    keys = {"planner.kind": "faulty", "planner.options": f"fault={[*FAULTS].index(fault)}"}
    config = load(None, {**KEYS, "team.robots": 1, **keys})
    rollout = Rollout(config, None, references_of(config))
    plans = []
    for tick in rollout.ticks(800):
        plans += [out.plan for out in tick.outputs.values() if out.plan is not None]
    assert not rollout.world.fallen()
    for out in tick.outputs.values():
        assert out.mode == WALK
        assert out.counters["refused_plan_of_faulty"] == len(plans) > 15
    for plan in plans:
        sent = decode(encode(plan), Plan)
        assert sent.status == f"nominal:plan of faulty refused: {fault}"
        assert sent.u.shape == (10, 12)
        assert (sent.y[:, 1] <= 0.3).all()
    assert rollout.world.truth().base_vel[:, 0].min() > 0.15
