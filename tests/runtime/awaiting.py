"""When a walk has come to a tick, by what is heard of it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import pytest

from quadriga.shared.bus.session import Bus
from quadriga.shared.codec import decode
from quadriga.shared.messages import Truth
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.topics import TRUTH
from tests.runtime.conftest import WAIT

TEAM: Final = "team"


def payloads(bus: Bus, key: str) -> Iterator[bytes]:
    """What is published on a key, as it is heard."""
    deadline = monotonic() + WAIT
    while monotonic() < deadline:
        packet = bus.get(1.0)
        if packet is not None and packet[0] == key:
            yield packet[1]
    pytest.fail(f"nothing more is heard on {key}")


def await_tick(bus: Bus, tick: int) -> int:
    """The world's time, as soon as it is `tick` or later."""
    found = (decode(payload, Truth).tick for payload in payloads(bus, TRUTH.key(TEAM)))
    return next(now for now in found if now >= tick)
