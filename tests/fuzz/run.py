"""Many inputs through one target, and what came of them."""

from __future__ import annotations

import resource
from dataclasses import dataclass
from math import inf

import numpy as np

from quadriga.shared.errors import QuadrigaError
from quadriga.shared.runtime.clock import monotonic
from tests.fuzz.targets import Target


@dataclass(frozen=True, slots=True)
class Tally:
    """What came of some inputs.

    Attributes:
        inputs: how many were read.
        refused: how many of them with an error.
        seconds: that took.
        slowest_ms: the slowest of them.
        slowest: its number.
        grown_mb: by how much the process's greatest memory grew meanwhile.
        longest: characters of the longest error.
    """

    inputs: int
    refused: int
    seconds: float
    slowest_ms: float
    slowest: int
    grown_mb: float
    longest: int

    def __str__(self) -> str:
        slowest = f"the slowest in {self.slowest_ms:.1f} ms (number {self.slowest})"
        return (
            f"{self.inputs:,} inputs in {self.seconds:.0f} s, {self.refused:,} refused, {slowest}, "
            f"{self.grown_mb:.0f} MB more, longest error {self.longest} characters"
        )


def fuzz(target: Target, inputs: int, seed: int, seconds: float = inf) -> Tally:
    """Read inputs until they, or so many seconds, are over; each depends on its number alone.

    Raises:
        AssertionError: one raised something that is no error of the tree; it is named.
    """
    begun, before = monotonic(), _peak_mb()
    refused, longest, slowest_ms, slowest = 0, 0, 0.0, 0
    read = 0
    for number in range(inputs):
        if monotonic() - begun > seconds:
            break
        read += 1
        content = target.make(np.random.default_rng([seed, number]))
        since = monotonic()
        try:
            target.read(content)
        except QuadrigaError as error:
            refused += 1
            longest = max(longest, len(str(error)))
        except BaseException as error:
            error.add_note(f"seed {seed}, input {number}: {content[:200]!r}")
            raise
        took_ms = 1e3 * (monotonic() - since)
        if took_ms > slowest_ms:
            slowest_ms, slowest = took_ms, number
    took, grown = monotonic() - begun, _peak_mb() - before
    return Tally(read, refused, took, slowest_ms, slowest, grown, longest)


def _peak_mb() -> float:
    """Greatest resident memory so far, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000
