"""Waiting for another process, so that no test depends on how fast it is."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from quadriga.shared.bus.session import Bus
from quadriga.shared.errors import RecordingError
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.clock import monotonic, sleep

WAIT = 60.0  # s, far more than anything takes on a busy machine


def await_true(happens: Callable[[], object], missing: Callable[[], object] = str) -> None:
    """Wait until something happens; if it never does, fail and tell what is missing."""
    deadline = monotonic() + WAIT
    while not happens():
        assert monotonic() < deadline, missing()
        sleep(0.02)


def await_listener(bus: Bus, key: str, *, there: bool = True) -> None:
    """Wait until somebody, or nobody any more, hears what `bus` publishes on `key`."""
    publisher: Any = bus._session.declare_publisher(key)
    await_true(
        lambda: bool(publisher.matching_status.matching) is there,
        lambda: f"{'nobody' if there else 'somebody'} hears {key}",
    )
    publisher.undeclare()


def await_recorded(path: Path, count: int) -> None:
    """Wait until a recording that is being written, or a folder of them, holds `count` messages."""

    def found() -> int:
        try:
            files = list(path.glob("*.mcap")) if path.is_dir() else [path]
            return sum(1 for file in files for _ in Recording(file).entries())
        except RecordingError:
            return 0  # its first bytes are still to come

    await_true(lambda: found() >= count, lambda: f"{path} holds {found()} messages, not {count}")
