"""No damaged byte ends outside the error tree; `make fuzz-readers` reads 100,000 of each."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from quadriga.shared.errors import ConfigError
from tests.fuzz.__main__ import main
from tests.fuzz.run import Limits, Tally, fuzz
from tests.fuzz.targets import KINDS, targets

# Inputs of those kinds that most of the time is for, and the share of all inputs that is refused at
# least: damage that nobody notices shows nothing. What walks say in messages that decode is read.
INPUTS = {"messages": 1500, "configurations": 400, "predictors": 200, "recordings": 80}
FEW = 40
REFUSED = 0.25
READ = ("traces", "exports", "replays", "realtime-replays", "variants")


@pytest.mark.parametrize("kind", KINDS)
def test_no_input_is_anything_but_read_or_refused(kind: str, tmp_path: Path) -> None:
    inputs = INPUTS.get(kind, FEW // 2 if kind in READ else FEW)
    with targets(tmp_path) as build:
        tally = fuzz(build(kind), inputs, seed=7)
    # No test decides by how fast this machine is.
    assert not tally.complaints(Limits(input_ms=float("inf")))
    assert tally.refused <= tally.inputs == inputs
    assert kind in READ or tally.refused > REFUSED * inputs


class Strange:
    """Refuses every other input, and fails in its own way at each tenth."""

    def make(self, random: np.random.Generator) -> bytes:
        return bytes([int(random.integers(10))])

    def read(self, content: bytes) -> None:
        if content[0] == 0:
            raise KeyError("never")
        if content[0] % 2:
            raise ConfigError("this", "that", "x" * 40)


def test_what_is_no_error_of_the_tree_is_told_once_for_each_place() -> None:
    tally = fuzz(Strange(), 200, seed=0)
    assert tally.inputs == 200
    assert 60 < tally.refused < 140
    (finding,) = tally.findings
    assert "KeyError at tests/fuzz/test_fuzz.py:" in finding
    assert "seed 0, input " in finding
    assert tally.complaints(Limits()) == tally.findings


def test_a_limit_that_is_broken_is_a_clear_line() -> None:
    tally = Tally(9, 3, 1.0, 700.0, 4, 900.0, 300.0, 6, 5000, ())
    assert not tally.complaints(Limits(input_ms=1e3, grown_mb=400.0, error=9999))
    slow, large, long = tally.complaints(Limits(input_ms=500.0, grown_mb=200.0, error=2500))
    assert slow == "input 4 took 700 ms of processor time, at most 500 are allowed"
    assert large == "memory grew by 300 MB, last at input 6; at most 200 are allowed"
    assert long == "an error of 5000 characters, at most 2500 are allowed"


@pytest.mark.parametrize(("limit", "status"), [("1e9", 0), ("0", 1)])
def test_the_command_writes_its_figures_and_fails_beyond_a_limit(
    limit: str, status: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "figures.json"
    words = ["--only", "authorities", "--inputs", "5", "--limit-ms", limit, "--json", str(file)]
    assert main(words) == status
    said = capsys.readouterr().err
    assert ("processor time, at most 0 are allowed" in said) == bool(status)
    figures = json.loads(file.read_text(encoding="utf-8"))
    assert figures["seed"] == 0
    assert figures["kinds"]["authorities"]["inputs"] == 5
    assert bool(figures["kinds"]["authorities"]["complaints"]) == bool(status)
