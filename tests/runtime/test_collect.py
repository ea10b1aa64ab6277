"""A collection that is interrupted stops at once, and none of its workers stays."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from quadriga.shared.runtime.clock import monotonic, sleep
from tests.runtime.conftest import WAIT

pytestmark = pytest.mark.usefixtures("_compiled")


def descendants(pid: int) -> set[int]:
    """Ids of a process's living children and theirs."""
    found = set()
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in map(int, task.read_text().split()):
            found |= {child} | descendants(child)
    return found


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().split()[2] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.parametrize(
    ("number", "status"),
    [(signal.SIGINT, 130), (signal.SIGTERM, 130), (signal.SIGKILL, -signal.SIGKILL)],
)
def test_an_interrupted_collection(tmp_path: Path, number: signal.Signals, status: int) -> None:
    collection = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "quadriga",
            "collect",
            "--robots",
            "1",
            "--set",
            "identification.seconds=600",
        ],
        env={**os.environ, "XDG_CACHE_HOME": str(tmp_path)},
        start_new_session=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline = monotonic() + WAIT
    # The workers and multiprocessing's resource tracker.
    while len(workers := descendants(collection.pid)) < 2 and monotonic() < deadline:
        sleep(0.05)
    assert len(workers) >= 2
    sleep(0.5)
    if number == signal.SIGINT:  # as a terminal does
        os.killpg(collection.pid, number)
    else:
        collection.send_signal(number)
    _, errors = collection.communicate(timeout=WAIT)
    assert collection.returncode == status
    assert "Traceback" not in errors
    while any(map(alive, workers)) and monotonic() < deadline:
        sleep(0.05)
    assert not [pid for pid in workers if alive(pid)]
    assert not list(tmp_path.rglob("*.npz"))
