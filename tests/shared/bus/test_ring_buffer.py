"""Many threads put, one takes; nobody waits longer than asked; of a key the newest are kept."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from threading import Thread, Timer

import pytest

from quadriga.shared.bus.ring_buffer import Mailbox
from quadriga.shared.runtime.clock import monotonic, sleep

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
    mailbox = Mailbox[int](9)
    rescue = Timer(5.0, mailbox.put, (1,))  # releases who waits without limit
    rescue.start()
    assert mailbox.take(0.1) is None
    rescue.cancel()


def test_all_items_come_each_threads_own_in_order() -> None:
    mailbox = Mailbox[tuple[int, int]](_THREADS * _ITEMS)

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
    assert not mailbox.drain()


@pytest.mark.parametrize("timeout", [0.0, 1e-9, 0.05])
def test_an_item_that_was_taken_without_waiting_leaves_no_false_alarm(timeout: float) -> None:
    mailbox = Mailbox[int](9)
    mailbox.put(1)
    mailbox.put(2)
    assert mailbox.take(_LONG) == 1
    assert mailbox.drain() == [2]
    begin = monotonic()
    assert mailbox.take(timeout) is None
    assert monotonic() - begin >= timeout
    Timer(0.05, mailbox.put, (3,)).start()
    assert mailbox.take(_LONG) == 3
    assert monotonic() - begin < _LONG / 2


def test_a_mailbox_that_overflows_while_it_is_read_keeps_the_order_and_counts() -> None:
    mailbox, taken = Mailbox[int](50), list[int]()

    def send() -> None:
        for k in range(_ITEMS):
            mailbox.put(k)

    sender = Thread(target=send)
    sender.start()
    while sender.is_alive():
        taken += mailbox.drain()
    taken += mailbox.drain()
    assert taken == sorted(set(taken))
    assert len(taken) + mailbox.dropped == _ITEMS
    for k in range(60):
        mailbox.put(k)
    assert mailbox.drain() == list(range(10, 60))
