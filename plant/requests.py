"""What people have asked of a plant since it was called last."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

from quadriga.shared.bus.session import Bus
from quadriga.shared.codec import decode
from quadriga.shared.errors import MessageError
from quadriga.shared.messages import EStop, LiveFault, Reset, SafeStop
from quadriga.shared.topics import ESTOP, LIVE_FAULT, RESET, STOP

_UNREADABLE: Final = EStop(0, 0, "unreadable")  # somebody wanted to stop the team


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
    topics = {topic.key(bus.team): topic for topic in (ESTOP, RESET, STOP, LIVE_FAULT)}
    take = bus.collect(*topics)

    def receive() -> Requests:
        asked = NO_REQUESTS
        for _, key, payload in take():
            try:
                message = decode(payload, topics[key].type)
            except MessageError:
                if topics[key] is not ESTOP:
                    continue
                message = _UNREADABLE
            if isinstance(message, EStop):
                asked = asked._replace(estop=asked.estop or message.reason or ESTOP.name)
            elif isinstance(message, Reset):
                asked = asked._replace(reset=message)
            elif isinstance(message, SafeStop):
                asked = asked._replace(stop=message)
            elif isinstance(message, LiveFault):
                asked = asked._replace(faults=(*asked.faults, message.fault))
        return asked

    return receive
