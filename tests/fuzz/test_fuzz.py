"""No damaged byte ends outside the error tree; `make fuzz-readers` reads 100,000 of each."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.fuzz.run import fuzz
from tests.fuzz.targets import targets

# Inputs, and how many of them are refused at least: damage that nobody notices shows nothing.
KINDS = {
    "messages": (1500, 700),
    "configurations": (500, 250),
    "predictors": (400, 200),
    "recordings": (120, 60),
}


@pytest.mark.parametrize("kind", KINDS)
def test_no_input_is_anything_but_read_or_refused(kind: str, tmp_path: Path) -> None:
    inputs, refused = KINDS[kind]
    with targets(tmp_path) as known:
        tally = fuzz(known[kind], inputs, seed=7)
    assert refused <= tally.refused <= inputs
    assert tally.grown_mb < 200.0
    assert tally.longest < 2500
