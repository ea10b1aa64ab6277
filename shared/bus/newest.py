"""The newest messages of a key, for whoever looks now and then and waits for none of them."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple


class Fresh(NamedTuple):
    """What has come since the last look.

    Attributes:
        messages: how many came; fewer than were sent, where more came than are kept.
        payloads: the newest of them, oldest first.
    """

    messages: int
    payloads: list[bytes]


class Newest:
    """What is kept of a key.

    Args:
        receive: gives the oldest message that is kept and forgets it; None: there is none.
    """

    def __init__(self, receive: Callable[[], Any]) -> None:
        self._receive = receive

    def take(self, wanted: int) -> Fresh:
        """What has come since this was called last, with at most `wanted` payloads."""
        count, newest = 0, deque[Any](maxlen=wanted)
        while (sample := self._receive()) is not None:
            count += 1
            newest.append(sample)
        return Fresh(count, [sample.payload.to_bytes() for sample in newest])
