"""What comes in answer to a question on the bus."""

from __future__ import annotations

from queue import SimpleQueue

Heard = tuple[int, str, bytes]  # when, ns of the wall clock, and the key and payload of an answer


class Answers:
    """The answers to one question; a thread that receives them fills it, another one reads it.

    Attributes:
        asked_ns: when the question was asked, by the wall clock.
        over: whether nothing more will come: all who can answer have, or the time is over.
    """

    def __init__(self, asked_ns: int) -> None:
        self.asked_ns = asked_ns
        self.over = False
        self._heard: SimpleQueue[Heard] = SimpleQueue()

    def note(self, at_ns: int, key: str, payload: bytes) -> None:
        """An answer has come."""
        self._heard.put((at_ns, key, payload))

    def end(self) -> None:
        """Nothing more will come."""
        self.over = True

    def take(self) -> list[Heard]:
        """All that has come since this was called last, oldest first."""
        return [self._heard.get_nowait() for _ in range(self._heard.qsize())]
