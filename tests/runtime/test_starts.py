"""That the search for orphans finds one; and some walks that are started and stopped."""

from __future__ import annotations

import os
import random
import subprocess
import sys

import pytest

from tests.runtime import starts


def test_an_orphan_is_found_and_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(starts, "_LEAVE", 0.2)
    mark = f"{os.getpid()}-orphan"
    words = [sys.executable, "-c", "import time; time.sleep(60)"]
    with subprocess.Popen(words, env={**os.environ, starts._MARK: mark}) as orphan:
        (line,) = starts._await_no_orphans(mark)
        assert "sleep(60)" in line
        assert orphan.wait(10.0) == -9
    assert starts._await_no_orphans(mark) == []


@pytest.mark.usefixtures("_alone", "_compiled")
def test_no_process_outlives_a_walk_that_is_stopped() -> None:
    chance = random.Random(11)
    attempts = [starts.attempt(number, chance) for number in range(2)]
    assert not [found for found in attempts if found.wrong]
