"""One recorded walk for all commands that look into one, and one team for those to a live one."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import pytest

_WALK: Final = ("walk", "--no-report", "--no-view", "--set", "runtime.priority=ordinary")
# The team that `make prepared` collects for.
_PREPARED: Final = ("--robots", "2", "--set", "identification.seconds=60", "--seconds", "2")
_ALONE: Final = ("--robots", "1", "--planner", "none", "--seconds", "600")
_LIMIT: Final = 120.0  # s, far more than a short walk takes on a busy machine


@contextmanager
def walking(folder: Path, *options: str) -> Iterator[subprocess.Popen[str]]:
    """A team that is started and, should it still run, interrupted."""
    words = (sys.executable, "-m", "quadriga", *_WALK, *options, "--out", str(folder))
    log = folder.with_suffix(".log")
    with log.open("w", encoding="utf-8") as output:
        process = subprocess.Popen(words, stdout=output, stderr=subprocess.STDOUT, text=True)
        try:
            yield process
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
            process.wait(_LIMIT)


@pytest.fixture(scope="session")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run folder of two seconds of two robots in lock-step."""
    folder = tmp_path_factory.mktemp("manual") / "run"
    with walking(folder, *_PREPARED) as process:
        status = process.wait(_LIMIT)
    assert status == 0, folder.with_suffix(".log").read_text(encoding="utf-8")
    return folder


@pytest.fixture(scope="session")
def live_team(tmp_path_factory: pytest.TempPathFactory) -> Iterator[subprocess.Popen[str]]:
    """A robot that walks until somebody stops it."""
    folder = tmp_path_factory.mktemp("live") / "run"
    with walking(folder, *_ALONE) as process:
        yield process
