"""What people have said to a plant since it was asked last."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Final, NamedTuple, TypeVar

from quadriga.shared.bus.zenoh_bus import Bus
from quadriga.shared.errors import MessageError
from quadriga.shared.wire.codec import decode
from quadriga.shared.wire.messages import EStop, Message, Reset, SafeStop
from quadriga.shared.wire.topics import ESTOP, RESET, STOP, Topic

M = TypeVar("M", bound=Message)
_UNREADABLE: Final = "unreadable"


class Words(NamedTuple):
    """What was said; of several of a kind the last, of emergency stops the first.

    Attributes:
        estop: why the team's emergency stop was pressed; "" if it was not.
        reset: the operator's release of one.
        stop: somebody's wish that the team slow down and stand.
    """

    estop: str = ""
    reset: Reset | None = None
    stop: SafeStop | None = None


NO_WORDS: Final = Words()


def listen_to_words(bus: Bus) -> Callable[[], Words]:
    """A function that gives what people have said since it was called last."""
    estop, reset = listen_to_estops(bus), _last_of(bus, RESET, Reset)
    stop = _last_of(bus, STOP, SafeStop)
    return lambda: Words(estop(), reset(), stop())


def listen_to_estops(bus: Bus) -> Callable[[], str]:
    """A function that tells why the emergency stop was pressed; "" until it is."""
    take = bus.collect(ESTOP.key(bus.team))

    def reason() -> str:
        for _, _, payload in take():
            try:
                return decode(payload, EStop).reason or ESTOP.name
            except MessageError:
                return _UNREADABLE  # somebody wanted to stop the team
        return ""

    return reason


def _last_of(bus: Bus, topic: Topic, kind: type[M]) -> Callable[[], M | None]:
    take = bus.collect(topic.key(bus.team))

    def last() -> M | None:
        found: M | None = None
        for _, _, payload in take():
            with suppress(MessageError):
                found = decode(payload, kind)
        return found

    return last
