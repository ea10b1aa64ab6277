"""What other threads put in and one thread takes out, waiting no longer than it says."""

from __future__ import annotations

from collections import deque
from contextlib import suppress
from threading import Lock
from typing import Final, Generic, TypeVar

from quadriga.shared.runtime.clock import monotonic

INBOX: Final = 1 << 16  # packets that wait for a process at most, some seconds of ten robots
Item = TypeVar("Item")


class Mailbox(Generic[Item]):
    """A queue for many threads that put and one that takes.

    `queue.SimpleQueue` is no substitute: in Python 3.11 its `get` may wait for ever, whatever its
    timeout, when a signal's handler or a busy computer takes up the time that was left. It then
    computes a negative rest, which it takes for no limit. To put into and
    take from a `queue.Queue` costs ten times as much.

    Args:
        most: how many items wait at most: one more drops the oldest, so that who is too slow for
            its senders does not fill the memory; 0: no limit.

    Attributes:
        dropped: how many items were dropped so.
    """

    def __init__(self, most: int = 0) -> None:
        self.dropped = 0
        self._items: deque[Item] = deque(maxlen=most or None)
        self._empty = Lock()  # released by `put`; whoever waits for an item acquires it
        self._empty.acquire()

    def __len__(self) -> int:
        return len(self._items)

    def put(self, item: Item) -> None:
        """Add an item, from any thread."""
        if len(self._items) == self._items.maxlen:
            self.dropped += 1
        self._items.append(item)
        if self._empty.locked():
            with suppress(RuntimeError):  # another thread has released it since
                self._empty.release()

    def take(self, timeout: float) -> Item | None:
        """The oldest item, waiting at most `timeout` seconds for one; None if none comes."""
        if self._items:
            return self._items.popleft()
        deadline = monotonic() + timeout
        # The lock may be free because of an item that was taken without waiting: then look again.
        while self._empty.acquire(timeout=max(0.0, deadline - monotonic())):
            if self._items:
                return self._items.popleft()
        return None

    def drain(self) -> list[Item]:
        """All items that are there, oldest first, without waiting."""
        return [self._items.popleft() for _ in range(len(self._items))]
