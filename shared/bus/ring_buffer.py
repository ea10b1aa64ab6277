"""What other threads put in and one thread takes out: a bounded queue."""

from __future__ import annotations

from collections import deque
from contextlib import suppress
from threading import Lock
from typing import Generic, TypeVar

from quadriga.shared.runtime.clock import monotonic

Item = TypeVar("Item")


class Mailbox(Generic[Item]):
    """A queue for many threads that put and one that takes.

    `queue.SimpleQueue` is no substitute: in Python 3.11 its `get` may wait for ever, whatever its
    timeout, when a signal's handler takes up the time that was left. `queue.Queue` costs ten times
    as much.

    Args:
        most: how many items wait at most: one more drops the oldest, so that who is too slow for
            its senders does not fill the memory.

    Attributes:
        dropped: how many items were dropped so.
    """

    def __init__(self, most: int) -> None:
        self.dropped = 0
        self._items: deque[Item] = deque(maxlen=most)
        self._empty = Lock()  # released by `put`; whoever waits for an item acquires it
        self._empty.acquire()

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
        if not timeout:
            return None
        deadline = monotonic() + timeout
        # The lock may be free because of an item that was taken without waiting: then look again.
        while self._empty.acquire(timeout=max(0.0, deadline - monotonic())):
            if self._items:
                return self._items.popleft()
        return None

    def drain(self) -> list[Item]:
        """All items that are there, oldest first, without waiting."""
        return [self._items.popleft() for _ in range(len(self._items))]
