"""No damaged byte that others may have written ends outside the error tree, at any reader.

None may take long or end in an error that fills the screen either. `make nightly` reads thousands
of inputs of each kind.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from time import thread_time
from typing import Final

import numpy as np
import pytest

from quadriga.shared.errors import ConfigError, QuadrigaError
from tests.fuzz import arrays, certificates, configurations, messages, recordings
from tests.fuzz.target import Reader, Target

KINDS: Final[Mapping[str, Callable[[Path], Target]]] = {
    "messages": messages.Messages,
    "answers": messages.answers,
    "orders": messages.orders,
    "drivers": messages.drivers,
    "operator-answers": messages.operator_answers,
    "configurations": configurations.Configurations,
    "reference-traces": configurations.reference_traces,
    "predictors": arrays.predictors,
    "certificates": certificates.Certificates,
    "authorities": certificates.authorities,
    "recordings": recordings.Recordings,
}
# Inputs of those kinds that most of the time is for, and the share of all inputs that is refused at
# least: damage that nobody notices shows nothing.
INPUTS = {"messages": 600, "configurations": 160, "predictors": 80, "recordings": 40}
INPUTS |= {"certificates": 200, "authorities": 200}  # whose keys are others each time
FEW = 20
REFUSED = 0.25
MOST_S: Final = 5.0  # of processor time that an input may take
LONGEST: Final = 2500  # characters of an error


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
    tally = Tally(0, {})
    for number in range(inputs):
        content = target.make(np.random.default_rng([seed, number]))
        place, told, begun = "", "", thread_time()
        try:
            target.read(content)
        except QuadrigaError as error:
            tally.refused += 1
            place, told = "long error" if len(str(error)) > LONGEST else "", str(error)
        except Exception as error:
            place, told = _place_of(error), str(error)
        if not place and thread_time() - begun > MOST_S:
            place = f"more than {MOST_S:g} s"
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


def check_kind(kind: str, folder: Path, inputs: int, seed: int) -> None:
    with np.errstate(all="ignore"):
        tally = fuzz(KINDS[kind](folder), inputs, seed)
    assert not tally.findings, "\n".join(tally.findings.values())
    assert tally.refused > REFUSED * inputs


@pytest.mark.parametrize("kind", KINDS)
def test_no_input_is_anything_but_read_or_refused(kind: str, tmp_path: Path) -> None:
    check_kind(kind, tmp_path, INPUTS.get(kind, FEW), seed=7)


@pytest.mark.nightly
@pytest.mark.parametrize("kind", KINDS)
def test_thousands_of_inputs(kind: str, tmp_path: Path) -> None:
    check_kind(kind, tmp_path, 10 * INPUTS.get(kind, 10 * FEW), seed=8)


def test_what_must_not_be_is_told_once_for_each_place() -> None:
    """Another error, and one that fills the screen."""
    numbers = iter(range(6))

    def read(content: bytes) -> None:
        if content[0] == 0:
            raise KeyError("never")
        raise ConfigError("this", "that", "x" * (LONGEST if content[0] == 1 else 1))

    tally = fuzz(Reader((b"",), read, lambda *_: bytes([next(numbers) % 3])), 6, seed=0)
    assert tally.refused == 4
    key, long = sorted(tally.findings.values(), key=lambda line: line.split(": ")[1])
    assert "input 0: KeyError at tests/fuzz/test_fuzz.py:" in key
    assert "input 1: long error: " in long
