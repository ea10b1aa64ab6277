"""The inputs of one robot's low level on a real walk, tick by tick, for a benchmark."""

from __future__ import annotations

from dataclasses import dataclass

from quadriga.agents.agent import Agent, AgentState, Inputs, Outputs
from quadriga.agents.predictor.predictor import Predictor
from quadriga.identification.rollout import Rollout
from quadriga.shared.codec import encode
from quadriga.shared.config.sections import Config
from quadriga.team.operator import references_of


@dataclass(frozen=True, slots=True)
class AgentTick:
    """All inputs of an agent at one tick; the robot's state as bytes of the wire."""

    payload: bytes
    inputs: Inputs


def record(config: Config, predictor: Predictor | None) -> list[AgentTick]:
    """Walk `config` in this process and record the inputs of r1 at every tick."""
    rollout = Rollout(config, predictor, references_of(config))
    agent = _RecordingAgent(rollout.agents["r1"])
    rollout.agents["r1"] = agent
    for _ in rollout.ticks(round(1000 * config.world.duration)):
        pass
    return agent.ticks


class _RecordingAgent(Agent):
    """An agent that records its inputs."""

    def __init__(self, agent: Agent) -> None:
        self._agent = agent
        self.ticks: list[AgentTick] = []

    def step(self, state: AgentState, inputs: Inputs) -> tuple[AgentState, Outputs]:
        self.ticks.append(AgentTick(encode(inputs.state), inputs))
        return self._agent.step(state, inputs)
