"""Running an agent again on what it was recorded to have heard."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import groupby

from quadriga.agents.agent import Agent
from quadriga.agents.inbox import Inbox
from quadriga.agents.predictor.predictor import Predictor
from quadriga.shared.codec import encode
from quadriga.shared.config.sections import Config
from quadriga.shared.recording.reader import ChunkEntry
from quadriga.shared.runtime.arithmetic import use_one_blas_thread
from quadriga.shared.topics import COMMAND, MEASUREMENT, PLAN

OUTPUTS = (COMMAND, MEASUREMENT, PLAN)


def rerun(
    entries: Iterable[ChunkEntry], config: Config, robot: str, predictor: Predictor
) -> list[tuple[str, bytes]]:
    """What the agent of `robot` sends when it hears a recording again: keys and payloads.

    For lock-step only: there what an agent knows at a tick follows from the ticks of the messages.
    """
    use_one_blas_thread()
    agent = Agent(config, robot, predictor)
    arrivals = Inbox(config, robot, agent.peers)
    memory, sent = agent.initial(), []
    for _, packets in groupby(entries, key=lambda entry: entry.tick):
        for entry in packets:
            if entry.key in arrivals.topics:
                arrivals.take(entry.key, entry.payload)
        state = arrivals.pop_state()
        if state is None:
            continue
        inputs = arrivals.pop_inputs(state, agent.expected(state.tick))
        memory, out = agent.step(memory, inputs)
        for topic, message in zip(OUTPUTS, (out.command, out.measurement, out.plan), strict=True):
            if message is not None:
                sent.append((topic.key(config.team.name, robot), encode(message)))
    return sent


def recorded(entries: Iterable[ChunkEntry], config: Config, robot: str) -> list[tuple[str, bytes]]:
    """What the agent of `robot` was recorded to have sent, in the order of the recording."""
    keys = {topic.key(config.team.name, robot) for topic in OUTPUTS}
    return [(entry.key, entry.payload) for entry in entries if entry.key in keys]
