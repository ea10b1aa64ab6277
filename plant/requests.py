"""What people have asked of a plant since it was called last."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Final

from quadriga.shared.bus.session import Bus
from quadriga.shared.codec import decode
from quadriga.shared.errors import MessageError
from quadriga.shared.messages import EStop, Message
from quadriga.shared.topics import ESTOP, LIVE_FAULT, RESET, STOP

_UNREADABLE: Final = EStop(0, 0, "unreadable")  # somebody wanted to stop the team


def subscribe_requests(bus: Bus) -> Callable[[], list[Message]]:
    """A function that gives what people have asked for since it was called last, oldest first.

    It is called at every tick and nearly always finds nothing, so it looks in one place.
    """
    topics = {topic.key(bus.team): topic for topic in (ESTOP, RESET, STOP, LIVE_FAULT)}
    take = bus.collect(*topics)

    def receive() -> list[Message]:
        asked = list[Message]()
        for _, key, payload in take():
            try:
                asked.append(decode(payload, topics[key].type))
            except MessageError:
                asked += [_UNREADABLE] if topics[key] is ESTOP else []
        return asked

    return receive


def find_estop(asked: Iterable[Message]) -> str:
    """Why somebody has pressed the emergency stop, of several the first; "": nobody has."""
    return next((m.reason or ESTOP.name for m in asked if isinstance(m, EStop)), "")
