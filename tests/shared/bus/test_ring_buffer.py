"""Many threads put, one takes; nobody waits longer than asked."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from threading import Thread, Timer

import pytest

from quadriga.shared.bus.ring_buffer import Mailbox
from quadriga.shared.runtime.clock import monotonic, sleep

_LONG = 30.0  # s
_THREADS, _ITEMS = 4, 5000
_ALL = _THREADS * _ITEMS


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


@pytest.mark.parametrize("most", [_ALL, 50])
def test_all_items_come_each_threads_own_in_order_or_are_counted(most: int) -> None:
    mailbox, taken = Mailbox[tuple[int, int]](most), list[tuple[int, int]]()

    def put_all(who: int) -> None:
        for k in range(_ITEMS):
            mailbox.put((who, k))

    senders = _THREADS if most == _ALL else 1  # several lose some of the count
    threads = [Thread(target=put_all, args=(who,)) for who in range(senders)]
    for thread in threads:
        thread.start()
    while any(thread.is_alive() for thread in threads):
        item = mailbox.take(0.01)
        taken += [] if item is None else [item, *mailbox.drain()]
    taken += mailbox.drain()
    for who in range(len(threads)):
        mine = [k for owner, k in taken if owner == who]
        assert mine == sorted(set(mine))
    assert len(taken) + mailbox.dropped == len(threads) * _ITEMS
    assert (mailbox.dropped > 0) <= (most < _ALL)


def test_one_too_many_drops_the_oldest() -> None:
    mailbox = Mailbox[int](50)
    for k in range(60):
        mailbox.put(k)
    assert mailbox.drain() == list(range(10, 60))
    assert mailbox.dropped == 10


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
