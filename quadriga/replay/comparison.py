"""Hold what an agent sends when it is run again against what it sent then, to the byte."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

from quadriga.agents.agent import AgentState, Inputs, Outputs
from quadriga.agents.inbox import order_of
from quadriga.replay.agent_log import AgentLog, Serial
from quadriga.replay.difference import Difference, find_difference
from quadriga.shared.codec import decode, encode
from quadriga.shared.errors import MessageError
from quadriga.shared.messages import Message
from quadriga.shared.topics import COMMAND, MEASUREMENT, PLAN, TABLE

# In the order in which one follows from the other within a step.
COMPARED = (MEASUREMENT, PLAN, COMMAND)
_TOPICS = {topic.name: topic for topic in TABLE}


@dataclass(frozen=True, slots=True)
class ReplayedStep:
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
        untold: messages that its agent sent before it was killed, and are not recomputed so, since
            it could not tell any more what it had taken in.
        missing: inputs that are not in the recording, with the tick of their step.
        last: the last tick replayed.
    """

    equal: Counter[str] = field(default_factory=Counter)
    differing: Counter[str] = field(default_factory=Counter)
    unrecorded: Counter[str] = field(default_factory=Counter)
    untold: Counter[str] = field(default_factory=Counter)
    first: Difference | None = None
    step: ReplayedStep | None = None
    missing: list[tuple[int, str]] = field(default_factory=list)
    last: int = -1

    @property
    def exact(self) -> bool:
        """Whether all that was recorded is recomputed, from inputs that are all there."""
        return self.first is None and not self.missing


class Comparison:
    """Holds what is recomputed against what was recorded.

    Args:
        log: what was recorded.
        on_pair: called with every recorded message and the one recomputed in its place.
    """

    def __init__(
        self, log: AgentLog, on_pair: Callable[[Message, Message], None] | None = None
    ) -> None:
        self._sent, self._on_pair = log.sent, on_pair
        self.verdict = ReplayVerdict()

    def recorded_messages(self, tick: int) -> dict[str, Message]:
        """The recorded messages of a step that is still to be compared, by topic."""
        messages = {}
        for name, at, exchange in tuple(self._sent):
            if name == PLAN.name or at == tick:
                message = _decode_first(name, self._sent[name, at, exchange])
                if message is not None and message.tick == tick:
                    messages[name] = message
        return messages

    def add(self, step: ReplayedStep, *, told: bool = True) -> None:
        """Compare the messages of one step; `told`: whether all that it took in is known."""
        verdict, tick = self.verdict, step.inputs.state.tick
        verdict.last = tick
        for topic in COMPARED:
            message = getattr(step.outputs, topic.name)
            if message is None:
                continue
            serial: Serial = (topic.name, *order_of(message))
            recorded = self._sent.pop(serial, [])
            self._show_pair(topic.name, recorded, message)
            if not recorded:
                verdict.unrecorded[topic.name] += 1
            elif encode(message) in recorded:
                verdict.equal[topic.name] += 1
            elif not told:
                verdict.untold[topic.name] += 1
            else:
                verdict.differing[topic.name] += 1
                if verdict.first is None:
                    verdict.first = find_difference(tick, topic.name, recorded[0], message)
                    verdict.step = step

    def _show_pair(self, name: str, recorded: Sequence[bytes], message: Message) -> None:
        if self._on_pair is None:
            return
        old = _decode_first(name, recorded)
        if old is not None:
            self._on_pair(old, message)

    def pass_untold(self, log: AgentLog) -> None:
        """Pass over what a killed agent sent, and is not recomputed, after its last record.

        Args:
            log: of the agent.
        """
        if log.told >= log.last:
            return
        for serial, payloads in tuple(self._sent.items()):
            name = serial[0]
            message = _decode_first(name, payloads)
            if message is not None and log.told < message.tick <= log.last:
                del self._sent[serial]
                self.verdict.untold[name] += 1

    def finish(self) -> ReplayVerdict:
        """The verdict, with messages counted that were recorded but are not recomputed."""
        verdict = self.verdict
        for (name, *_), payloads in sorted(self._sent.items()):
            message = _decode_first(name, payloads)
            if message is None or message.tick > verdict.last:
                continue  # nothing that an agent sends, or beyond where the replay ended
            verdict.differing[name] += 1
            if verdict.first is None or message.tick < verdict.first.tick:
                verdict.first = Difference(message.tick, name, "", "a message", "none")
                verdict.step = None
        return verdict


def _decode_first(name: str, payloads: Sequence[bytes]) -> Message | None:
    """The first valid message; others on an agent's key are not its own."""
    for payload in payloads:
        with suppress(MessageError):
            return decode(payload, _TOPICS[name].type)
    return None
