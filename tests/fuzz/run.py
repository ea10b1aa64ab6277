"""Many inputs through one target, and what came of them."""

from __future__ import annotations

import resource
import signal
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from math import inf
from pathlib import Path
from types import FrameType
from typing import Final

import numpy as np

from quadriga.shared.errors import QuadrigaError
from quadriga.shared.runtime.clock import monotonic, thread_ns
from tests.fuzz.target import Target

_FAMILIES: Final = 20  # findings that are told: thousands of inputs may lead to the same
_PATIENCE: Final = 60.0  # s of wall time, after which an input is given up


class OverdueError(BaseException):
    """An input takes so long that it is given up; no reader can take it for an error of its own."""


@dataclass(frozen=True, slots=True)
class Limits:
    """What a reader may take.

    Attributes:
        input_ms: processor time for one input, ms. It is generous: a reader that is bounded takes
            a few, and one that is not takes minutes.
        grown_mb: by how much memory may grow over all inputs of a kind, MB.
        error: characters of an error.
    """

    input_ms: float = 5000.0
    grown_mb: float = 200.0
    error: int = 2500


@dataclass(frozen=True, slots=True)
class Tally:
    """What came of some inputs.

    Attributes:
        inputs: how many were read.
        refused: how many of them with an error of the tree.
        seconds: wall time that took.
        slowest_ms: processor time of the slowest of them.
        slowest: its number.
        peak_mb: the process's greatest memory meanwhile.
        grown_mb: by how much that is more than before.
        greediest: number of the input that grew it last.
        longest: characters of the longest error.
        findings: what else was raised, a line for each place in the code that raised it.
    """

    inputs: int
    refused: int
    seconds: float
    slowest_ms: float
    slowest: int
    peak_mb: float
    grown_mb: float
    greediest: int
    longest: int
    findings: tuple[str, ...]

    def __str__(self) -> str:
        slowest = f"the slowest in {self.slowest_ms:.1f} ms (number {self.slowest})"
        memory = f"{self.grown_mb:.0f} MB more at most (number {self.greediest})"
        return (
            f"{self.inputs:,} inputs in {self.seconds:.0f} s, {self.refused:,} refused, {slowest}, "
            f"{memory}, longest error {self.longest} characters"
        )

    def complaints(self, limits: Limits) -> tuple[str, ...]:
        """What is not as it must be, a line each; () if all is well."""
        found = list(self.findings)
        if self.slowest_ms > limits.input_ms:
            found.append(
                f"input {self.slowest} took {self.slowest_ms:.0f} ms of processor time, "
                f"at most {limits.input_ms:.0f} are allowed"
            )
        if self.grown_mb > limits.grown_mb:
            found.append(
                f"memory grew by {self.grown_mb:.0f} MB, last at input {self.greediest}; "
                f"at most {limits.grown_mb:.0f} are allowed"
            )
        if self.longest > limits.error:
            found.append(
                f"an error of {self.longest} characters, at most {limits.error} are allowed"
            )
        return tuple(found)


def fuzz(target: Target, inputs: int, seed: int, seconds: float = inf, first: int = 0) -> Tally:
    """Read inputs from number `first` on until they, or so many seconds, are over.

    Each depends on its number alone. So several processes can share them.
    """
    _forget_peak()
    begun = monotonic()
    before = peak = _peak_mb()
    refused = longest = slowest = greediest = read = 0
    slowest_ms = 0.0
    findings: dict[str, str] = {}
    for number in range(first, first + inputs):
        if monotonic() - begun > seconds:
            break
        read += 1
        content = target.make(np.random.default_rng([seed, number]))
        since = thread_ns()
        try:
            with _given_up_after(_PATIENCE):
                target.read(content)
        except QuadrigaError as error:
            refused += 1
            longest = max(longest, len(str(error)))
        except (Exception, OverdueError) as error:
            place = _place_of(error)
            if len(findings) < _FAMILIES:
                line = f"seed {seed}, input {number}: {place}: {str(error)[:120]!r}"
                findings.setdefault(place, f"{line} of {content[:60]!r}")
        took_ms = 1e-6 * (thread_ns() - since)
        if took_ms > slowest_ms:
            slowest_ms, slowest = took_ms, number
        if (now := _peak_mb()) > peak:
            peak, greediest = now, number
    took, grown = monotonic() - begun, peak - before
    told = tuple(findings.values())
    return Tally(read, refused, took, slowest_ms, slowest, peak, grown, greediest, longest, told)


def _place_of(error: BaseException) -> str:
    """Which error it is, and the last line of this project's code that it came through."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if "site-packages" not in frame.filename]
    own = [frame for frame in own if "/lib/python" not in frame.filename] or list(frames)
    last = own[-1]
    return f"{type(error).__name__} at {'/'.join(Path(last.filename).parts[-3:])}:{last.lineno}"


@contextmanager
def _given_up_after(seconds: float) -> Iterator[None]:
    """Leave the block with an `OverdueError` once so many seconds are over."""

    def give_up(_number: int, _frame: FrameType | None) -> None:
        raise OverdueError(f"not done within {seconds:g} s")

    before = signal.signal(signal.SIGALRM, give_up)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _forget_peak() -> None:
    """Begin anew with the greatest memory, where the system permits it."""
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")


def _peak_mb() -> float:
    """Greatest resident memory so far, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000
