"""What one robot's low level takes in on a real walk, tick by tick, for a benchmark."""

from __future__ import annotations

from dataclasses import dataclass

from quadriga.agents.agent import Agent, AgentState, Inputs, Outputs
from quadriga.agents.controller.whole_body.problem import Goal
from quadriga.agents.predictor.predictor import Predictor
from quadriga.identification.rollout import Rollout
from quadriga.shared.config.sections import Config
from quadriga.shared.robot.a1 import Array
from quadriga.shared.wire.codec import encode
from quadriga.team.operator import references_of


@dataclass(frozen=True, slots=True)
class AgentTick:
    """Everything that reached an agent at one tick; its own state as it was on the wire."""

    payload: bytes
    inputs: Inputs


@dataclass(frozen=True, slots=True)
class TsidCase:
    """What one tick gives the whole-body part.

    Attributes:
        sensed: `Sensed.flat`.
        q: Pinocchio's configuration, (19,).
        v: Pinocchio's velocity, (18,).
        goal: what the QP is asked for.
    """

    sensed: Array
    q: Array
    v: Array
    goal: Goal


def record(config: Config, predictor: Predictor | None) -> list[AgentTick]:
    """Walk `config` in this process and keep what r1 consumed at every tick."""
    rollout = Rollout(config, predictor, references_of(config))
    agent = _RecordingAgent(rollout.agents["r1"])
    rollout.agents["r1"] = agent
    for _ in rollout.ticks(round(1000 * config.world.seconds)):
        pass
    return agent.ticks


class _RecordingAgent(Agent):
    """An agent that keeps what it is given."""

    def __init__(self, agent: Agent) -> None:
        self._agent = agent
        self.ticks: list[AgentTick] = []

    def step(self, state: AgentState, inputs: Inputs) -> tuple[AgentState, Outputs]:
        self.ticks.append(AgentTick(encode(inputs.state), inputs))
        return self._agent.step(state, inputs)
