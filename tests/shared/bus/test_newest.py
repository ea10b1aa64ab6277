"""Real Zenoh: of what comes the newest is kept, and nobody waits."""

from __future__ import annotations

from contextlib import ExitStack

from quadriga.shared.bus.newest import Newest
from quadriga.shared.bus.zenoh_bus import Bus
from quadriga.shared.config.sections import BusConfig
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.team.endpoint import free_endpoint
from tests.listening import WAIT, await_listener


def last_of(newest: Newest, wanted: bytes) -> list[bytes]:
    """What has come once the message `wanted` has."""
    seen: list[bytes] = []
    deadline = monotonic() + WAIT
    while seen[-1:] != [wanted]:
        assert monotonic() < deadline, seen[-3:]
        sleep(0.005)
        seen += newest.take(8).payloads
    return seen


def test_the_newest_messages_are_kept_and_the_inbox_has_none() -> None:
    config = BusConfig(endpoint=free_endpoint(), plaintext=True)
    with ExitStack() as stack:
        sim, looker = (stack.enter_context(Bus.open(config, "t", name)) for name in ("sim", "v-1"))
        newest = looker.keep_newest("t/r1/state", 4)
        await_listener(sim, "t/r1/state")
        put = sim.publisher("t/r1/state")
        for k in range(1000):
            put(b"%d" % k)
        seen = last_of(newest, b"999")
        assert seen == sorted(seen, key=int)
        assert newest.take(8) == (0, [])
        put(b"a")
        put(b"b")
        assert last_of(newest, b"b")[-1:] == [b"b"]
        assert not looker.drain()


class _Sample:
    """What Zenoh hands out, as far as it is looked at."""

    def __init__(self, payload: bytes) -> None:
        self.payload = self
        self._bytes = payload

    def to_bytes(self) -> bytes:
        return self._bytes


def test_all_that_came_is_counted_and_only_what_is_wanted_is_copied() -> None:
    samples = [_Sample(b"%d" % k) for k in range(5)]
    newest = Newest(lambda: samples.pop(0) if samples else None)
    assert newest.take(2) == (5, [b"3", b"4"])
    assert newest.take(2) == (0, [])
