"""Whether agents still do what the golden recording holds, and where they do not."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from itertools import zip_longest

import numpy as np

from quadriga.replay.difference import Difference, find_difference
from quadriga.shared.codec import decode
from quadriga.shared.messages import Message
from quadriga.shared.topics import topic_of

TOLERANCE = 1e-6  # of a field's largest magnitude in the recording, for arrays

Packets = Sequence[tuple[str, bytes]]

REMEDY = (
    "If this change of behaviour is meant, state it and renew the recording:\n"
    '    python -m tests.golden.renew --reason "what the agents do differently now, and why"'
)


def differences(here: Mapping[str, str], there: Mapping[str, str]) -> list[str]:
    """What decides on the last bits of two machines and differs, in words."""
    return [
        f"{name} {value!r} instead of {there.get(name, 'unknown')!r}"
        for name, value in sorted(here.items())
        if value != there.get(name)
    ]


def first_difference(recorded: Packets, recomputed: Packets) -> Difference | None:
    """The first message that is not the recorded one to the byte, and its first field."""
    for old, new in zip_longest(recorded, recomputed):
        if old == new:
            continue
        if old is None or new is None:
            there = ("a message", "none") if old else ("none", "a message")
            return _about(old or new, *there)
        if old[0] != new[0]:
            return _about(old, "a message", f"one of {new[0]}")
        return find_difference(_decoded(*old).tick, old[0], old[1], _decoded(*new))
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
    return {
        field: value / (scale[field] or 1.0) if value else 0.0 for field, value in found.items()
    }


def _decoded(key: str, payload: bytes) -> Message:
    return decode(payload, topic_of(key)[0].type)


def _about(packet: tuple[str, bytes], recorded: str, recomputed: str) -> Difference:
    return Difference(_decoded(*packet).tick, packet[0], "", recorded, recomputed)


@dataclass(frozen=True)
class Verdict:
    """`ok`, and one sentence or a few."""

    ok: bool
    text: str


def judge(robot: str, recorded: Packets, recomputed: Packets, unlike: Sequence[str]) -> Verdict:
    """Compare to the byte; within `TOLERANCE` where other machines may differ in the last bits.

    Args:
        robot: whose messages these are.
        recorded: keys and payloads.
        recomputed: the same of the present code.
        unlike: in what the arithmetic here is not that of the machine that recorded.
    """
    difference = first_difference(recorded, recomputed)
    if difference is None:
        return Verdict(True, f"{robot}: all {len(recorded)} messages equal to the byte")
    deviations = largest_deviations(recorded, recomputed)
    field = max(deviations, key=lambda name: deviations[name])
    largest = f"largest deviation {deviations[field]:.1e} in {field}"
    if unlike and deviations[field] <= TOLERANCE:
        return Verdict(
            True,
            (
                f"{robot}: {len(recorded)} messages equal within {TOLERANCE:g}, not to the byte "
                f"({largest}), since this machine computes with {'; '.join(unlike)}"
            ),
        )
    elsewhere = f"\nThis machine computes with {'; '.join(unlike)}." if unlike else ""
    return Verdict(
        False,
        (
            f"The agent of {robot} no longer does what the golden recording holds.\n"
            f"First difference: {difference}\n{largest}, relative to its largest magnitude."
            f"{elsewhere}\n{REMEDY}"
        ),
    )
