"""What an agent took in at which tick, recorded wherever the rules do not determine it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from quadriga.agents.inbox.inbox import Inbox, Order, Source, order_of
from quadriga.agents.planning.interface import NOTHING, Expected
from quadriga.agents.step_io import Inputs
from quadriga.shared.config.sections import Config
from quadriga.shared.members import OPERATOR, SIM
from quadriga.shared.messages import Consumed, Message
from quadriga.shared.topics import (
    MEASUREMENT,
    PLAN,
    REFERENCE,
    REFERENCE_EPOCH_MS,
    REQUESTS,
    STATUS,
    TRUTH,
)

ANYONE: Final = "anyone"  # who stopped the team, released a stop or had it go on
_UNRULED: Final = frozenset(topic.name for topic in REQUESTS)
_FIRST: Final = (-1, 0)


class Intake:
    """Decides at each step whether a `Consumed` is due.

    In real time what an agent knew depends on who was faster: one is due at every step that took
    in more than the state after the last one. In lock-step `Inbox` and `Agent.expected` tell what
    is taken in at each tick. One is due when a message was missing or came too late for the step
    that expected it, when a state was passed over, once a valid message was refused, and for every
    message that no rule expects.

    Args:
        config: the team's configuration.
        inbox: where the agent's inputs come from.
    """

    def __init__(self, config: Config, inbox: Inbox) -> None:
        self._lockstep = config.world.mode == "lockstep"
        self._inbox = inbox
        self._number = 0
        self._handed_over: dict[Source, Order] = {}  # in lock-step: up to where

    def record(self, last: int, inputs: Inputs, expected: Expected) -> Consumed | None:
        """The record of one step, if one is due.

        Args:
            last: tick of the step before, −1 before the first.
            inputs: what this step took in; nothing has been taken in since.
            expected: what it expected.
        """
        tick = inputs.state.tick
        if tick == last + 1 and expected is NOTHING and inputs.bare:
            return None
        taken, owed = list_messages(inputs), frozenset[Source]()
        unusual = bool(taken)
        if self._lockstep:
            unusual = self._inbox.refused or not self._by_rule(taken)
            if expected != NOTHING:
                owed = self._inbox.missing_sources(tick, expected)
                self._handed_over.update(self._inbox.list_due(tick, expected))
        if not (unusual or owed or tick != last + 1):
            return None
        record = Consumed(
            tick,
            tick * 1_000_000,
            self._number,
            tick - last - 1,
            tuple(format_message_id(*item) for item in taken),
            tuple(sorted("/".join(source) for source in owed)),
        )
        self._number += 1
        return record

    def _by_rule(self, taken: Iterable[tuple[Source, Order]]) -> bool:
        """Whether all that was taken in was due now, and at no earlier step."""
        return all(
            has_rule(source, order) and order > self._handed_over.get(source, _FIRST)
            for source, order in taken
        )


def has_rule(source: Source, order: Order) -> bool:
    """Whether the rules of lock-step speak of such a message.

    They know nothing of what people ask for, nor of a second operator's references between those
    of the first.
    """
    if source[0] == REFERENCE.name:
        return order[0] % REFERENCE_EPOCH_MS == 0
    return source[0] not in _UNRULED


def list_messages(inputs: Inputs) -> list[tuple[Source, Order]]:
    """Source and order of every message of a step but the state."""
    messages: list[tuple[str, str, Message]] = [
        *((PLAN.name, name, plan) for name, plan in inputs.plans),
        *((MEASUREMENT.name, name, sample) for name, sample in inputs.measurements),
        *((REFERENCE.name, OPERATOR, reference) for reference in inputs.references),
        *((STATUS.name, name, status) for name, status in inputs.statuses),
    ]
    for topic, request in zip(REQUESTS, inputs.requests, strict=True):
        if request is not None:
            messages.append((topic.name, ANYONE, request))
    if inputs.truth is not None:
        messages.append((TRUTH.name, SIM, inputs.truth))
    return [((name, sender), order_of(message)) for name, sender, message in messages]


def format_message_id(source: Source, order: Order) -> str:
    """How `Consumed` refers to a message: `plan:r1:12.0`, `measurement:r1:480`."""
    topic, sender = source
    serial = f"{order[0]}.{order[1]}" if topic == PLAN.name else str(order[0])
    return f"{topic}:{sender}:{serial}"


def parse_message_id(text: str) -> tuple[Source, Order] | None:
    """The inverse of `format_message_id`; None for what it never writes."""
    parts = text.split(":")
    serial = parts[-1].split(".")
    if len(parts) != 3 or len(serial) > 2 or not all(part.isdecimal() for part in serial):
        return None
    step, exchange = (*serial, "0")[:2]
    return (parts[0], parts[1]), (int(step), int(exchange))
