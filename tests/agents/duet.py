"""Two robots walking with a planner whose predictor is known, and all that passed at each tick."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import Any

import numpy as np

from quadriga.agents.agent import Agent, AgentState, Inputs, Outputs
from quadriga.agents.planning.active_plan import PlanCheck, Setpoint, setpoint_at
from quadriga.agents.planning.interface import (
    ActivePlan,
    PlanningInputs,
    PlanningInterface,
    PlanningOutputs,
)
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.identification.rollout import Rollout
from quadriga.shared.codec import decode, encode
from quadriga.shared.config.sections import Config, PlannerConfig, TeamConfig
from quadriga.shared.messages import Reference, State
from quadriga.shared.robots.conventions import N_FORCES, N_OUTPUTS, Array

CONFIG = Config(team=TeamConfig(robots=2), planner=PlannerConfig(latency_ms=0))
FIRST_PLAN = 320  # ms: the first multiple of 40 ms after the stand of 300 ms


def simple_predictor(config: Config) -> Predictor:
    """Every robot for itself: outputs fade within 50 ms and are driven by the forces till then."""
    meta, N, T_ini = PredictorMeta.of(config), config.planner.N, config.planner.T_ini
    effect = np.zeros((N_OUTPUTS, N_FORCES))
    for leg in range(4):
        effect[0, 3 * leg + 2] = 2e-5  # m per N and sample
        effect[1, 3 * leg] = effect[2, 3 * leg + 1] = 8e-4  # m/s per N and sample
    forget = np.exp(-0.2)
    fading = np.array([[forget ** (k - j) if k >= j else 0.0 for j in range(N)] for k in range(N)])
    G = np.zeros((meta.robots, meta.robots, N_OUTPUTS * N, meta.layout.width))
    last = meta.layout.past - N_OUTPUTS  # column of the newest output in [u_ini; y_ini]
    assert last == N_FORCES * T_ini + N_OUTPUTS * (T_ini - 1)
    for robot in range(meta.robots):
        fade = forget ** np.arange(1.0, N + 1.0)
        G[robot, robot, :, last : meta.layout.past] = np.kron(fade[:, None], np.eye(N_OUTPUTS))
        G[robot, robot, :, meta.layout.past :] = np.kron(fading, effect)
    return Predictor(meta, G[None])


def coupled(config: Config, strength: float = 0.3) -> Predictor:
    """What a robot does to itself it does to its peer as well, more weakly."""
    alone = simple_predictor(config)
    G, past = alone.G.copy(), alone.layout.past
    for i in range(2):
        G[:, i, 1 - i, :, past:] = strength * G[:, i, i, :, past:]
    return Predictor(alone.meta, G)


def asked(vx: float = 0.3) -> Reference:
    return Reference(0, 0, vx, 0.0, 0.0, 0.26)


def every_100_ms(tick: int) -> Reference | None:
    """From standing to 0.3 m/s within half a second after the stand."""
    if tick % 100:
        return None
    return replace(
        asked(0.3 * min(1.0, max(0.0, (tick - 300) / 500))), tick=tick, stamp_ns=tick * 1_000_000
    )


def over_the_bus(state: State) -> State:
    """The same message as it arrives; the compiler tells its arrays from writable ones."""
    return decode(encode(state), State)


@dataclass(frozen=True)
class Step:
    """One step of an agent: what it was given, what it remembered before, what it gave."""

    before: AgentState
    inputs: Inputs
    outputs: Outputs


@dataclass
class Listener:
    """Stands before an agent and notes every step."""

    agent: Agent
    steps: list[Step] = field(default_factory=list)

    def step(self, state: AgentState, inputs: Inputs) -> tuple[AgentState, Outputs]:
        after, outputs = self.agent.step(state, inputs)
        self.steps.append(Step(state, inputs, outputs))
        return after, outputs


def record(rollout: Rollout, ticks: int) -> dict[str, list[Step]]:
    """Advance a rollout and return every agent's steps."""
    listeners = {name: Listener(agent) for name, agent in rollout.agents.items()}
    rollout.agents.update(listeners)  # type: ignore[arg-type]
    for _ in rollout.ticks(ticks):
        pass
    return {name: listener.steps for name, listener in listeners.items()}


class Planned:
    """An agent's planning with the plans that are in force, as its agent has them."""

    def __init__(self, config: Config, index: int, planning: PlanningInterface[Any]) -> None:
        self.planning, self._check = planning, PlanCheck(config, index)
        self.state, self.plans = planning.initial(), tuple[ActivePlan, ...]()

    def step(self, inputs: PlanningInputs) -> PlanningOutputs:
        self.state, outputs = self.planning.step(self.state, inputs)
        outputs, self.plans = self._check.admit(outputs, inputs, self.plans)
        return outputs

    def applied(self, tick: int) -> Setpoint:
        return setpoint_at(self.plans, tick)


def fingerprint(value: Any) -> Any:
    """Everything a value consists of, arrays as bytes: equal if and only if nothing changed."""
    if isinstance(value, np.ndarray):
        array: Array = value
        return (array.shape, array.tobytes())
    if is_dataclass(value):
        return tuple(fingerprint(getattr(value, item.name)) for item in fields(value))
    if isinstance(value, tuple | list):
        return tuple(fingerprint(item) for item in value)
    if hasattr(value, "items"):
        return tuple(sorted((key, fingerprint(item)) for key, item in value.items()))
    return value
