"""Running an agent again on what it was recorded to have heard."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import groupby

from agents.agent import Agent
from agents.arrivals import Arrivals
from agents.planner.predictor import Predictor
from shared.blas import one_blas_thread
from shared.codec import encode
from shared.config import Config
from shared.recording import Entry
from shared.topics import COMMAND, MEASUREMENT, PLAN

OUTPUTS = (COMMAND, MEASUREMENT, PLAN)


def rerun(
    entries: Iterable[Entry], config: Config, robot: str, predictor: Predictor
) -> list[tuple[str, bytes]]:
    """What the agent of `robot` sends when it hears a recording again: keys and payloads.

    For lock-step only: there what an agent knows at a tick follows from the ticks of the messages.
    """
    one_blas_thread()
    agent = Agent(config, robot, predictor)
    arrivals = Arrivals(config, robot, agent.peers)
    memory, sent = agent.initial(), []
    for _, packets in groupby(entries, key=lambda entry: entry.tick):
        for entry in packets:
            if entry.key in arrivals.keys:
                arrivals.take(entry.key, entry.payload)
        state = arrivals.state()
        if state is None:
            continue
        inputs = arrivals.inputs(state, agent.awaited(state.tick))
        memory, out = agent.step(memory, inputs)
        for topic, message in zip(OUTPUTS, (out.command, out.measurement, out.plan), strict=True):
            if message is not None:
                sent.append((topic.key(config.team.name, robot), encode(message)))
    return sent


def recorded(entries: Iterable[Entry], config: Config, robot: str) -> list[tuple[str, bytes]]:
    """What the agent of `robot` was recorded to have sent, in the order of the recording."""
    keys = {topic.key(config.team.name, robot) for topic in OUTPUTS}
    return [(entry.key, entry.payload) for entry in entries if entry.key in keys]
