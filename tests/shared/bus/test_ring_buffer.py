"""Many threads put, one takes; nobody waits longer than asked; of a key the newest are kept."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import ExitStack
from threading import Thread, Timer

import pytest

from quadriga.shared.bus.ring_buffer import Mailbox, Newest
from quadriga.shared.bus.session import Bus
from quadriga.shared.config.sections import BusConfig
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.team.endpoint import free_endpoint
from tests.listening import WAIT, await_listener

_LONG = 30.0  # s
_THREADS, _ITEMS = 4, 5000


@pytest.fixture
def _slow_handler() -> Iterator[None]:
    """A signal comes in 50 ms, whose handler takes 200 ms."""
    before = signal.signal(signal.SIGALRM, lambda *_: sleep(0.2))
    signal.setitimer(signal.ITIMER_REAL, 0.05)
    yield
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.usefixtures("_slow_handler")
def test_a_signal_whose_handler_takes_longer_than_the_timeout_makes_nobody_wait_for_ever() -> None:
    mailbox = Mailbox[int]()
    rescue = Timer(5.0, mailbox.put, (1,))  # releases who waits without limit
    rescue.start()
    assert mailbox.take(0.1) is None
    rescue.cancel()


def test_all_items_come_each_threads_own_in_order() -> None:
    mailbox = Mailbox[tuple[int, int]]()

    def put_all(who: int) -> None:
        for k in range(_ITEMS):
            mailbox.put((who, k))

    threads = [Thread(target=put_all, args=(who,)) for who in range(_THREADS)]
    for thread in threads:
        thread.start()
    taken: list[tuple[int, int]] = []
    while len(taken) < _THREADS * _ITEMS:
        item = mailbox.take(_LONG)
        assert item is not None
        taken += [item, *mailbox.drain()]
    for who in range(_THREADS):
        assert [k for owner, k in taken if owner == who] == list(range(_ITEMS))
    assert len(mailbox) == 0


def test_who_waits_is_woken() -> None:
    mailbox, begin = Mailbox[int](), monotonic()
    Timer(0.05, mailbox.put, (1,)).start()
    assert mailbox.take(_LONG) == 1
    assert monotonic() - begin < _LONG / 2


@pytest.mark.parametrize("timeout", [0.0, 1e-9, 0.05])
def test_an_item_that_was_taken_without_waiting_leaves_no_false_alarm(timeout: float) -> None:
    mailbox = Mailbox[int]()
    mailbox.put(1)
    mailbox.put(2)
    assert mailbox.take(_LONG) == 1
    assert mailbox.drain() == [2]
    begin = monotonic()
    assert mailbox.take(timeout) is None
    assert monotonic() - begin >= timeout
    mailbox.put(3)
    assert mailbox.take(timeout) == 3


def test_a_full_mailbox_drops_the_oldest_and_counts() -> None:
    mailbox = Mailbox[int](3)
    for k in range(5):
        mailbox.put(k)
    assert mailbox.dropped == 2
    assert mailbox.take(0.0) == 2
    mailbox.put(5)
    assert mailbox.drain() == [3, 4, 5]
    assert mailbox.dropped == 2


def test_a_mailbox_that_overflows_while_it_is_read_keeps_the_order() -> None:
    mailbox, taken = Mailbox[int](50), list[int]()

    def send() -> None:
        for k in range(_ITEMS):
            mailbox.put(k)

    sender = Thread(target=send)
    sender.start()
    while sender.is_alive() or len(mailbox):
        taken += mailbox.drain()
    assert taken == sorted(set(taken))
    assert len(taken) + mailbox.dropped == _ITEMS


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
