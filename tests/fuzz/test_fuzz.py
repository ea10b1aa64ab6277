"""No damaged byte that others may have written ends outside the error tree, at any reader.

None may take long, need much memory or end in an error that fills the screen either. `make nightly`
reads thousands of inputs of each kind.
"""

from __future__ import annotations

import resource
import signal
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from time import thread_time
from types import FrameType
from typing import Final

import numpy as np
import pytest

from quadriga.shared.errors import ConfigError, QuadrigaError
from tests.fuzz import arrays, campaigns, certificates, configurations, messages, recordings, walks
from tests.fuzz.target import Reader, Target

KINDS: Final[Mapping[str, Callable[[Path], Target]]] = {
    "messages": messages.Messages,
    "packets": messages.packets,
    "answers": messages.answers,
    "orders": messages.orders,
    "drivers": messages.drivers,
    "operator-answers": messages.operator_answers,
    "configurations": configurations.Configurations,
    "experiments": configurations.experiments,
    "reference-traces": configurations.reference_traces,
    "manifests": campaigns.manifests,
    "trials": campaigns.trials,
    "packs": campaigns.Packs,
    "json-rows": campaigns.json_rows,
    "predictors": arrays.predictors,
    "datasets": arrays.datasets,
    "saved-programs": arrays.saved_programs,
    "certificates": certificates.Certificates,
    "authorities": certificates.authorities,
    "recordings": recordings.Recordings,
    "traces": walks.traces,
    "exports": walks.exports,
    "replays": walks.replays,
    "realtime-replays": walks.realtime_replays,
}
# Inputs of those kinds that most of the time is for, and the share of all inputs that is refused at
# least: damage that nobody notices shows nothing. What walks say in messages that decode is read.
# Keys of certificates are others each time.
INPUTS = {"messages": 600, "configurations": 160, "predictors": 80, "recordings": 40}
INPUTS |= {"packets": 600, "certificates": 200, "authorities": 200}
FEW = 20
REFUSED = 0.25
READ = ("traces", "exports", "replays", "realtime-replays")
PATIENCE: Final = 60.0  # s of wall time, after which an input is given up
MOST_S: Final = 5.0  # of processor time that an input may take
MOST_MB: Final = 200.0  # that memory may grow
LONGEST: Final = 2500  # characters of an error


class OverdueError(BaseException):
    """An input takes so long that it is given up; no reader can take it for an error of its own."""


@dataclass
class Tally:
    """How many inputs were refused with an error of the tree, and what else came of them.

    Attributes:
        findings: what else was raised, a line for each place in the code that raised it, and for
            each limit that was broken.
    """

    refused: int
    findings: dict[str, str]


def fuzz(target: Target, inputs: int, seed: int) -> Tally:
    """Read inputs, each of which depends on its number alone."""
    with suppress(OSError):  # the greatest memory is that from now on, where that is permitted
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    before, tally = _peak_mb(), Tally(0, {})
    for number in range(inputs):
        content = target.make(np.random.default_rng([seed, number]))
        place, told, begun = "", "", thread_time()
        try:
            with _given_up_after(PATIENCE):
                target.read(content)
        except QuadrigaError as error:
            tally.refused += 1
            place, told = "long error" if len(str(error)) > LONGEST else "", str(error)
        except (Exception, OverdueError) as error:
            place, told = _place_of(error), str(error)
        if not place and thread_time() - begun > MOST_S:
            place = f"more than {MOST_S:g} s"
        if not place and _peak_mb() - before > MOST_MB:
            place = f"more than {MOST_MB:g} MB"
        if place:
            line = f"seed {seed}, input {number}: {place}: {told[:120]!r} of {content[:60]!r}"
            tally.findings.setdefault(place, line)
    return tally


def _place_of(error: BaseException) -> str:
    """Which error it is, and the last line of this project's code that it came through."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if "site-packages" not in frame.filename]
    last = ([frame for frame in own if "/lib/python" not in frame.filename] or list(frames))[-1]
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


def _peak_mb() -> float:
    """Greatest resident memory so far, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000


def check_kind(kind: str, folder: Path, inputs: int, seed: int) -> None:
    with np.errstate(all="ignore"):
        tally = fuzz(KINDS[kind](folder), inputs, seed)
    assert not tally.findings, "\n".join(tally.findings.values())
    assert kind in READ or tally.refused > REFUSED * inputs


@pytest.mark.parametrize("kind", KINDS)
def test_no_input_is_anything_but_read_or_refused(kind: str, tmp_path: Path) -> None:
    check_kind(kind, tmp_path, INPUTS.get(kind, FEW // 2 if kind in READ else FEW), seed=7)


@pytest.mark.nightly
@pytest.mark.parametrize("kind", KINDS)
def test_thousands_of_inputs(kind: str, tmp_path: Path) -> None:
    check_kind(kind, tmp_path, 10 * INPUTS.get(kind, 10 * FEW), seed=8)


def test_what_must_not_be_is_told_once_for_each_place() -> None:
    """Another error, one that fills the screen, and an input that needs much memory."""
    numbers = iter(range(8))

    def read(content: bytes) -> None:
        if content[0] == 0:
            raise KeyError("never")
        if content[0] == 3:
            np.ones(round(2.0 * MOST_MB * 125_000))
        else:
            raise ConfigError("this", "that", "x" * (LONGEST if content[0] == 1 else 1))

    tally = fuzz(Reader((b"",), read, lambda *_: bytes([next(numbers) % 4])), 8, seed=0)
    assert tally.refused == 4
    key, long, memory = sorted(tally.findings.values(), key=lambda line: line.split(": ")[1])
    assert "input 0: KeyError at tests/fuzz/test_fuzz.py:" in key
    assert "input 1: long error: " in long
    assert "input 3: more than 200 MB: " in memory
