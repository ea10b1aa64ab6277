"""What an agent took in at which tick, told wherever it does not follow from the rules alone."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from quadriga.agents.agent import Inputs
from quadriga.agents.inbox.inbox import Inbox, Order, Source, order_of
from quadriga.agents.planning.interface import NOTHING, Expected
from quadriga.shared.bus.members import OPERATOR, SIM
from quadriga.shared.config.sections import Config
from quadriga.shared.wire.messages import Consumed, Message
from quadriga.shared.wire.topics import (
    ESTOP,
    MEASUREMENT,
    PLAN,
    REFERENCE,
    REFERENCE_EPOCH_MS,
    TRUTH,
)

ANYONE: Final = "anyone"  # who sent an emergency stop
_FIRST: Final = (-1, 0)


class Intake:
    """Decides at each step whether a `Consumed` is due.

    In real time what an agent knew depends on who was faster: due is one at every step that took
    in more than the state after the last one. In lock-step `Inbox` and `Agent.awaited` say what
    is taken in at each tick: due is one when a message was owed, or came too late for the step that
    awaited it, when a state was passed over, once a valid message was refused, and of what no rule
    expects.

    Args:
        config: the team's configuration.
        arrivals: where the agent's inputs come from.
    """

    def __init__(self, config: Config, arrivals: Inbox) -> None:
        self._lockstep = config.world.mode == "lockstep"
        self._arrivals = arrivals
        self._number = 0
        self._handed_over: dict[Source, Order] = {}  # in lock-step: up to where

    def record(self, last: int, inputs: Inputs, awaited: Expected) -> Consumed | None:
        """The record of one step, if one is due.

        Args:
            last: tick of the step before, −1 before the first.
            inputs: what this step took in; nothing has been taken in since.
            awaited: what it awaited.
        """
        tick = inputs.state.tick
        if tick == last + 1 and awaited is NOTHING and inputs.bare:
            return None
        taken, owed = taken_in(inputs), frozenset[Source]()
        unusual = bool(taken)
        if self._lockstep:
            unusual = self._arrivals.refused or not self._by_rule(taken)
            if awaited != NOTHING:
                owed = self._arrivals.owing(tick, awaited)
                self._handed_over.update(self._arrivals.wanted(tick, awaited))
        if not (unusual or owed or tick != last + 1):
            return None
        record = Consumed(
            tick,
            tick * 1_000_000,
            self._number,
            tick - last - 1,
            tuple(reference_to(*item) for item in taken),
            tuple(sorted("/".join(source) for source in owed)),
        )
        self._number += 1
        return record

    def _by_rule(self, taken: Iterable[tuple[Source, Order]]) -> bool:
        """Whether all that was taken in was due now, and at no earlier step."""
        return all(
            expected(source, order) and order > self._handed_over.get(source, _FIRST)
            for source, order in taken
        )


def expected(source: Source, order: Order) -> bool:
    """Whether the rules of lock-step speak of such a message.

    They know nothing of an emergency stop, nor of a second operator's words between those of the
    first.
    """
    if source[0] == REFERENCE.name:
        return order[0] % REFERENCE_EPOCH_MS == 0
    return source[0] != ESTOP.name


def taken_in(inputs: Inputs) -> list[tuple[Source, Order]]:
    """Source and order of every message of a step but the state."""
    found: list[tuple[str, str, Message]] = [
        *((PLAN.name, name, plan) for name, plan in inputs.plans),
        *((MEASUREMENT.name, name, sample) for name, sample in inputs.measurements),
        *((REFERENCE.name, OPERATOR, reference) for reference in inputs.references),
    ]
    if inputs.estop is not None:
        found.append((ESTOP.name, ANYONE, inputs.estop))
    if inputs.truth is not None:
        found.append((TRUTH.name, SIM, inputs.truth))
    return [((topic, sender), order_of(message)) for topic, sender, message in found]


def reference_to(source: Source, order: Order) -> str:
    """How `Consumed` refers to a message: `plan:r1:12.0`, `measurement:r1:480`."""
    topic, sender = source
    serial = f"{order[0]}.{order[1]}" if topic == PLAN.name else str(order[0])
    return f"{topic}:{sender}:{serial}"


def referred(text: str) -> tuple[Source, Order] | None:
    """The inverse of `reference_to`; None for what it never writes."""
    parts = text.split(":")
    serial = parts[-1].split(".")
    if len(parts) != 3 or len(serial) > 2 or not all(part.isdecimal() for part in serial):
        return None
    step, exchange = (*serial, "0")[:2]
    return (parts[0], parts[1]), (int(step), int(exchange))
