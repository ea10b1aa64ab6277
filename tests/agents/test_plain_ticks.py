"""Plain ticks give what `Agent.step` gives, to the byte, wherever they stand in for it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from random import Random
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.agents.agent import Agent, AgentState
from quadriga.agents.plain_ticks import PlainTicks
from quadriga.agents.predictor.gates import load_checked
from quadriga.agents.predictor.predictor import Predictor
from quadriga.agents.step_io import Inputs, Outputs
from quadriga.identification.rollout import Rollout
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Command
from quadriga.shared.modes import WALK as WALK_MODE
from quadriga.team.operator import references_of
from tests.golden.scenario import KEYS, PREDICTOR

TAU = Command.CUTS["tau"]
PLANNED = {key: value for key, value in KEYS.items() if key != "world.push"}
WALK = {"gait.stand_ms": 100, "reference.ramp": 0.2}


def alike(a: Any, b: Any) -> bool:
    """Whether two values are the same to the last bit."""
    if isinstance(a, np.ndarray):
        return isinstance(b, np.ndarray) and a.tobytes() == b.tobytes()
    if is_dataclass(a):
        names = [item.name for item in fields(a)] + ["row"] * hasattr(a, "row")
        return type(a) is type(b) and all(alike(getattr(a, n), getattr(b, n)) for n in names)
    if isinstance(a, tuple):
        return len(a) == len(b) and all(map(alike, a, b))
    if isinstance(a, Mapping):
        return list(a) == list(b) and all(alike(a[key], b[key]) for key in a)
    return bool(a == b)


class Doubled(Agent):
    """Steps, and answers each tick that can be plain by a plain one too, if `chooses()`."""

    def __init__(self, *args: Any, chooses: Callable[[], bool]) -> None:
        super().__init__(*args)
        self.plain, self.chooses = PlainTicks(self), chooses
        self.ticks = Counter[str]()

    def step(self, state: AgentState, inputs: Inputs) -> tuple[AgentState, Outputs]:
        after, outputs = super().step(state, inputs)
        if not self.answers(inputs) or not self.chooses():
            self.ticks["others"] += 1
            self.plain.arm(after)
            return after, outputs
        plain, tick = self.plain, inputs.state.tick
        tau = plain.answer(tick, inputs.state.row)
        if tau is None:
            self.ticks["given up"] += 1
            plain.arm(after)
            return after, outputs
        row = np.zeros_like(outputs.command.row)
        row[TAU] = tau
        assert row.tobytes() == outputs.command.row.tobytes(), tick
        if plain.is_due(tick) or not inputs.bare:
            self.ticks["due"] += 1
            assert plain.state is not None
            finished = self.finish_step(plain.state, inputs, plain.acted)
            assert alike(finished, (after, outputs)), tick
            plain.arm(after)
        else:
            self.ticks["plain"] += 1
            plain.keep()
            assert alike(plain.state, after), tick
        return after, outputs

    def answers(self, inputs: Inputs) -> bool:
        """As `agents.shell` decides it, of messages that come when they will."""
        tick = inputs.state.tick
        due = self.plain.is_due(tick) or not inputs.bare
        commands = inputs.references or any(inputs.requests) or inputs.truth is not None
        return self.plain.answers(tick) and not (commands or (due and self.plans_at_once))


def walk(
    config: Config, predictor: Predictor | None, ms: int, chooses: Callable[[], bool]
) -> Counter[str]:
    """Ticks by kind of all robots of a walk, each of which was doubled."""
    names = [f"r{1 + i}" for i in range(config.team.robots)]
    agents = {name: Doubled(config, name, predictor, chooses=chooses) for name in names}
    rollout = Rollout(config, predictor, references_of(config), agents=agents)
    for _ in rollout.ticks(ms):
        pass
    return sum((agent.ticks for agent in agents.values()), Counter[str]())


@pytest.fixture(scope="module")
def predictor() -> Predictor:
    return load_checked(PREDICTOR, load(None, KEYS))[0]


@pytest.mark.parametrize(
    ("keys", "gives_up"),
    [
        ({"world.terrain": "boxes"}, False),
        ({"world.push": "r1:250:90:0.4:0.2"}, True),
        ({"world.faults": "r1/encoder_FL_calf off 0.5 0.01"}, True),
    ],
    ids=["over blocks", "pushed over", "without an encoder"],
)
def test_a_robot_without_a_planner(keys: Mapping[str, Any], gives_up: bool) -> None:
    config = load(None, {"team.robots": 1, "planner.kind": "none", **WALK, **keys})
    ticks = walk(config, None, 1200, lambda: True)
    assert ticks["plain"] > 600
    assert ticks["due"] > 60, "ends of samples"
    assert (ticks["given up"] > 0) == gives_up


@settings(max_examples=6, deadline=None)
@given(
    seed=st.integers(0, 1000),
    latency=st.sampled_from([0, 1, 8]),
    exchanges=st.sampled_from([0, 1]),
    share=st.sampled_from([0.5, 1.0]),
)
def test_robots_that_plan_together(
    predictor: Predictor, seed: int, latency: int, exchanges: int, share: float
) -> None:
    keys = {"planner.latency_ms": latency, "planner.exchanges": exchanges, "world.seed": seed}
    random = Random(seed)
    config = load(None, {**PLANNED, **keys})
    ticks = walk(config, predictor, 500, lambda: random.random() < share)
    assert ticks["plain"] > 100
    assert (ticks["due"] == 0) == (latency == 0), "a plan that takes effect at once is waited for"


def test_ticks_of_one_who_knows_the_truth_are_not_plain() -> None:
    keys = {"team.robots": 1, "planner.kind": "none", "estimator.kind": "truth"}
    ticks = walk(load(None, {**keys, **WALK}), None, 300, lambda: True)
    assert ticks.keys() == {"others"}


def test_what_is_due_ends_plain_ticks() -> None:
    config = load(None, {"team.robots": 1, "planner.kind": "none", **WALK})
    agents, said = {"r1": Agent(config, "r1", None)}, references_of(config)
    last = Rollout(config, None, lambda tick: said(tick) if tick < 500 else None, agents=agents)
    until = {}
    for tick in last.ticks(1000):
        until[tick.tick] = agents["r1"].plain_until(last.states["r1"])
    assert until[50] == (50, 50), "it stands"
    assert until[603] == (610, 610), "a sample ends"
    assert until[899] == (900, 900), "the last reference, of 400 ms, is too old behind this"
    assert until[900] == (900, 900)
    assert last.states["r1"].mode.name != WALK_MODE
