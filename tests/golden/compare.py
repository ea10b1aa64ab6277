"""Where two sequences of messages differ: to the byte, or by how much."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import zip_longest
from typing import Any

import numpy as np

from shared.codec import decode
from shared.messages import Message
from shared.topics import topic_of

TOLERANCE = 1e-6  # of a field's largest magnitude in the recording, for arrays

Packets = Sequence[tuple[str, bytes]]


@dataclass(frozen=True)
class Difference:
    """The first place where recomputed messages are not the recorded ones."""

    tick: int
    key: str
    field: str
    recorded: str
    recomputed: str

    def __str__(self) -> str:
        return (
            f"tick {self.tick}, {self.key}, {self.field}: "
            f"recorded {self.recorded}, recomputed {self.recomputed}"
        )


def first_difference(recorded: Packets, recomputed: Packets) -> Difference | None:
    """The first message that is not the recorded one to the byte, and its first field."""
    for old, new in zip_longest(recorded, recomputed):
        if old == new:
            continue
        if old is None or new is None:
            key, payload = old or new
            tick = _decoded(key, payload).tick
            there = ("a message", "none") if old else ("none", "a message")
            return Difference(tick, key, "all", *there)
        then, now = _decoded(*old), _decoded(*new)
        if old[0] != new[0]:
            return Difference(then.tick, old[0], "all", f"{old[0]}", f"{new[0]} at {now.tick}")
        for item in fields(then):
            if found := _differ(item.name, getattr(then, item.name), getattr(now, item.name)):
                return Difference(then.tick, old[0], *found)
        return Difference(then.tick, old[0], "encoding", f"{old[1]!r}", f"{new[1]!r}")
    return None


def largest_deviations(recorded: Packets, recomputed: Packets) -> dict[str, float]:
    """By topic and field: the largest deviation, relative to the field's largest magnitude.

    Infinite for what is not a number and differs, and for messages that are missing or added.
    """
    found: defaultdict[str, float] = defaultdict(float)
    scale: defaultdict[str, float] = defaultdict(float)
    for old, new in zip_longest(recorded, recomputed):
        if old is None or new is None or old[0] != new[0]:
            return {"messages": float("inf")}
        name = topic_of(old[0])[0].name
        then, now = _decoded(*old), _decoded(*new)
        for item in fields(then):
            a, b = getattr(then, item.name), getattr(now, item.name)
            if not isinstance(a, np.ndarray) or a.shape != b.shape:
                equal = not isinstance(a, np.ndarray) and a == b
                found[f"{name}.{item.name}"] += 0.0 if equal else float("inf")
                continue
            field = f"{name}.{item.name}"
            scale[field] = max(scale[field], float(np.abs(a).max(initial=0.0)))
            found[field] = max(found[field], float(np.abs(b - a).max(initial=0.0)))
    return {field: value / (scale[field] or 1.0) if value else 0.0
            for field, value in found.items()}  # fmt: skip


def _decoded(key: str, payload: bytes) -> Message:
    return decode(payload, topic_of(key)[0].type)


def _differ(name: str, then: Any, now: Any) -> tuple[str, str, str] | None:
    """Name, recorded and recomputed value of a field or of its first element that differs."""
    if not isinstance(then, np.ndarray):
        return None if then == now else (name, repr(then), repr(now))
    if then.shape != now.shape:
        return name, f"shape {then.shape}", f"shape {now.shape}"
    where = np.argwhere((then != now) | (np.signbit(then) != np.signbit(now)))
    if not len(where):
        return None
    at = tuple(where[0].tolist())
    return f"{name}[{', '.join(map(str, at))}]", repr(float(then[at])), repr(float(now[at]))
