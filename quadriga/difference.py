"""The first field in which a recorded message and a recomputed one differ."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from shared.codec import decode
from shared.errors import MessageError
from shared.messages import Message


@dataclass(frozen=True, slots=True)
class Difference:
    """Where two messages part.

    Attributes:
        key, tick: of the message.
        field: its first field that differs, with the index of the first number for an array.
        recorded, recomputed: the values there, in full precision.
    """

    key: str
    tick: int
    field: str
    recorded: str
    recomputed: str

    def __str__(self) -> str:
        """One sentence."""
        return (
            f"first difference at tick {self.tick} ({self.tick / 1000:.3f} s), {self.key}, "
            f"{self.field}: recorded {self.recorded}, recomputed {self.recomputed}"
        )


def difference(key: str, tick: int, recorded: bytes, recomputed: Message) -> Difference:
    """What tells a recorded message from `recomputed`, whose bytes differ from it."""
    try:
        message = decode(recorded, type(recomputed))
    except MessageError as error:
        return Difference(key, tick, "message", f"one that is not valid ({error})", "a valid one")
    for item in fields(recomputed):
        was, now = getattr(message, item.name), getattr(recomputed, item.name)
        if "shape" not in item.metadata:
            if was != now:
                return Difference(key, tick, item.name, repr(was), repr(now))
        elif (found := _in_arrays(item.name, was, np.asarray(now))) is not None:
            return Difference(key, tick, *found)
    return Difference(key, tick, "bytes", "another order of the fields", "the codec's")


def _in_arrays(name: str, was: Any, now: Any) -> tuple[str, str, str] | None:
    if was.shape != now.shape:
        return name, f"shape {was.shape}", f"shape {now.shape}"
    # As bits: 0.0 and −0.0 are equal numbers of different bytes.
    apart = np.argwhere(was.view(np.int64) != np.ascontiguousarray(now).view(np.int64))
    if not len(apart):
        return None
    at = tuple(apart[0].tolist())
    many = f", {len(apart)} of {was.size} numbers differ" if len(apart) > 1 else ""
    where = f"{name}[{', '.join(map(str, at))}]{many}"
    return where, repr(float(was[at])), repr(float(now[at]))
