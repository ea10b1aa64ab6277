"""Whether agents still do what the golden recording holds, and what to say about it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tests.golden.compare import TOLERANCE, Packets, first_difference, largest_deviations

REMEDY = (
    "If this change of behaviour is meant, state it and renew the recording:\n"
    '    python -m tests.golden.renew --reason "what the agents do differently now, and why"'
)


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
