"""What people have asked of a plant since it was called last."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from typing import Final, NamedTuple

from quadriga.shared.bus.session import Arrival, Bus
from quadriga.shared.codec import decode
from quadriga.shared.errors import MessageError
from quadriga.shared.messages import EStop, LiveFault, Message, Reset, SafeStop
from quadriga.shared.topics import ESTOP, LIVE_FAULT, RESET, STOP

_UNREADABLE: Final = "unreadable"
_KINDS: Final = {ESTOP: EStop, RESET: Reset, STOP: SafeStop, LIVE_FAULT: LiveFault}


class Requests(NamedTuple):
    """What was asked for; of several of a kind the last, of emergency stops the first.

    Attributes:
        estop: why the team's emergency stop was pressed; "" if it was not.
        reset: the operator's release of one.
        stop: somebody's request that the team slow down and stand.
        faults: faults of sensors and motors that somebody has asked for.
    """

    estop: str = ""
    reset: Reset | None = None
    stop: SafeStop | None = None
    faults: tuple[str, ...] = ()


NO_REQUESTS: Final = Requests()


def subscribe_requests(bus: Bus) -> Callable[[], Requests]:
    """A function that gives what people have asked for since it was called last.

    It is called at every tick and nearly always finds nothing, so it looks in one place.
    """
    kinds = {topic.key(bus.team): kind for topic, kind in _KINDS.items()}
    take = bus.collect(*kinds)

    def receive() -> Requests:
        arrived = take()
        return _sort(kinds, arrived) if arrived else NO_REQUESTS

    return receive


def subscribe_estops(bus: Bus) -> Callable[[], str]:
    """A function that tells why the emergency stop was pressed; "" until it is."""
    take = bus.collect(ESTOP.key(bus.team))
    return lambda: next((_reason_of(payload) for _, _, payload in take()), "")


def _sort(kinds: Mapping[str, type[Message]], arrived: Iterable[Arrival]) -> Requests:
    requests = NO_REQUESTS
    for _, key, payload in arrived:
        if kinds[key] is EStop:
            requests = requests._replace(estop=requests.estop or _reason_of(payload))
            continue
        with suppress(MessageError):
            message = decode(payload, kinds[key])
            if isinstance(message, Reset):
                requests = requests._replace(reset=message)
            elif isinstance(message, SafeStop):
                requests = requests._replace(stop=message)
            elif isinstance(message, LiveFault):
                requests = requests._replace(faults=(*requests.faults, message.fault))
    return requests


def _reason_of(payload: bytes) -> str:
    """Why an emergency stop was pressed, never ""."""
    try:
        return decode(payload, EStop).reason or ESTOP.name
    except MessageError:
        return _UNREADABLE  # somebody wanted to stop the team
