"""An agent's own code over recorded inputs, and whether it says what it said then, to the byte."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

from quadriga.agents.agent import Agent, AgentState, Inputs, Outputs
from quadriga.agents.inbox.inbox import order_of
from quadriga.replay.agent_log import AgentLog, Serial
from quadriga.replay.difference import Difference, difference
from quadriga.replay.intake import Feed
from quadriga.shared.errors import MessageError
from quadriga.shared.wire.codec import decode, encode
from quadriga.shared.wire.messages import Message
from quadriga.shared.wire.topics import COMMAND, MEASUREMENT, PLAN, TABLE, Topic

# In the order in which one follows from the other within a step.
COMPARED = (MEASUREMENT, PLAN, COMMAND)
_TOPICS = {topic.name: topic for topic in TABLE}


@dataclass(frozen=True, slots=True)
class Step:
    """One step of the agent, made again.

    Attributes:
        before: what the agent remembered.
        inputs: what it took in.
        outputs: what the step gives now.
    """

    before: AgentState
    inputs: Inputs
    outputs: Outputs


@dataclass(slots=True)
class ReplayVerdict:
    """What a replay found.

    Attributes:
        equal: messages equal to the byte, by topic.
        differing: recorded messages that are not recomputed so, by topic.
        unrecorded: recomputed messages that the recording lacks, by topic.
        first: the first difference.
        step: the step at which it is.
        missing: inputs that are not in the recording, with the tick of their step.
        last: the last tick replayed.
    """

    equal: Counter[str] = field(default_factory=Counter)
    differing: Counter[str] = field(default_factory=Counter)
    unrecorded: Counter[str] = field(default_factory=Counter)
    first: Difference | None = None
    step: Step | None = None
    missing: list[tuple[int, str]] = field(default_factory=list)
    last: int = -1

    @property
    def exact(self) -> bool:
        """Whether all that was recorded is recomputed, from inputs that are all there."""
        return self.first is None and not self.missing


def rerun(
    agent: Agent,
    feed: Feed,
    note: Callable[[Step], None],
    missed: Callable[[int, str], bool],
    look: Callable[[AgentState, Inputs], None],
) -> None:
    """Step the agent over everything it took in.

    Args:
        agent: the agent as it shall be now.
        feed: what it took in.
        note: given every step.
        missed: told the tick and name of each input that is not in the recording; whether to
            stop there. Else the step goes without it.
        look: called before every step with the agent's memory and inputs.
    """
    memory = agent.initial()
    for fed in feed.steps():
        if any([missed(fed.tick, name) for name in fed.missing]):
            return
        if fed.inputs is None:
            continue
        look(memory, fed.inputs)
        before = memory
        memory, outputs = agent.step(memory, fed.inputs)
        note(Step(before, fed.inputs, outputs))


def said(outputs: Outputs) -> Iterator[tuple[Topic, Message]]:
    """The compared messages of a step."""
    for topic in COMPARED:
        message = getattr(outputs, topic.name)
        if message is not None:
            yield topic, message


class Comparison:
    """Holds what is recomputed against what was recorded.

    Args:
        tape: what was recorded.
        pair: given each two messages that differ or not, if anyone wants to see them.
    """

    def __init__(
        self, tape: AgentLog, pair: Callable[[Message, Message], None] | None = None
    ) -> None:
        self._said, self._pair = tape.said, pair
        self.verdict = ReplayVerdict()

    def recorded(self, tick: int) -> dict[str, Message]:
        """What was recorded of a step that is still to be noted, by topic."""
        found = {}
        for name, at, exchange in tuple(self._said):
            if name == PLAN.name or at == tick:
                message = _decoded(name, self._said[name, at, exchange])
                if message is not None and message.tick == tick:
                    found[name] = message
        return found

    def note(self, step: Step) -> None:
        """Compare the messages of one step."""
        verdict, tick = self.verdict, step.inputs.state.tick
        verdict.last = tick
        for topic, message in said(step.outputs):
            serial: Serial = (topic.name, *order_of(message))
            recorded = self._said.pop(serial, [])
            if self._pair is not None and (old := _decoded(topic.name, recorded)):
                self._pair(old, message)
            if not recorded:
                verdict.unrecorded[topic.name] += 1
            elif encode(message) in recorded:
                verdict.equal[topic.name] += 1
            else:
                verdict.differing[topic.name] += 1
                if verdict.first is None:
                    verdict.first = difference(tick, topic.name, recorded[0], message)
                    verdict.step = step

    def finish(self) -> ReplayVerdict:
        """The verdict, with messages counted that were recorded but are not recomputed."""
        verdict = self.verdict
        for (name, *_), payloads in sorted(self._said.items()):
            found = _decoded(name, payloads)
            if found is None or found.tick > verdict.last:
                continue  # nothing that an agent says, or beyond where the replay ended
            verdict.differing[name] += 1
            if verdict.first is None or found.tick < verdict.first.tick:
                verdict.first = Difference(found.tick, name, "", "a message", "none")
                verdict.step = None
        return verdict


def _decoded(name: str, payloads: Sequence[bytes]) -> Message | None:
    """The first valid message; others on an agent's key are not its own."""
    for payload in payloads:
        with suppress(MessageError):
            return decode(payload, _TOPICS[name].type)
    return None
