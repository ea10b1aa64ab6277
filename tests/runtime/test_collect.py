"""A collection that is interrupted stops at once, and none of its workers stays."""

from __future__ import annotations

import os
import signal
import subprocess
from pathlib import Path

import pytest

from quadriga.shared.runtime.clock import sleep
from quadriga.team.launch import QUADRIGA
from tests.listening import WAIT, await_true

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
    ("number", "status"), [(signal.SIGINT, 130), (signal.SIGKILL, -signal.SIGKILL)]
)
def test_an_interrupted_collection(tmp_path: Path, number: signal.Signals, status: int) -> None:
    collection = subprocess.Popen(
        (*QUADRIGA, "collect", "--robots", "1", "--set", "identification.seconds=600"),
        env={**os.environ, "XDG_CACHE_HOME": str(tmp_path)},
        start_new_session=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    # The workers and multiprocessing's resource tracker.
    await_true(lambda: len(descendants(collection.pid)) >= 2)
    sleep(0.5)
    workers = descendants(collection.pid)
    assert len(workers) >= 2
    kill = os.killpg if number == signal.SIGINT else os.kill  # the first as a terminal does
    kill(collection.pid, number)
    _, errors = collection.communicate(timeout=WAIT)
    assert collection.returncode == status
    assert "Traceback" not in errors
    await_true(lambda: not any(map(alive, workers)))
    assert not list(tmp_path.rglob("*.npz"))
