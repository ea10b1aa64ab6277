"""Waiting for another process to hear and to record, so that no test depends on how fast it is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from quadriga.shared.bus.session import Bus
from quadriga.shared.errors import RecordingError
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.clock import monotonic, sleep

WAIT = 60.0  # s, far more than anything takes on a busy machine


def await_listener(bus: Bus, key: str, *, there: bool = True) -> None:
    """Wait until somebody, or nobody any more, hears what `bus` publishes on `key`."""
    publisher: Any = bus._session.declare_publisher(key)
    deadline = monotonic() + WAIT
    while bool(publisher.matching_status.matching) is not there:
        assert monotonic() < deadline, f"{'nobody' if there else 'somebody'} hears {key}"
        sleep(0.01)
    publisher.undeclare()


def await_recorded(path: Path, count: int) -> None:
    """Wait until a recording that is being written, or a folder of them, holds `count` messages."""
    found, deadline = 0, monotonic() + WAIT
    while found < count:
        assert monotonic() < deadline, f"{path} holds {found} messages, not {count}"
        sleep(0.02)
        try:
            files = list(path.glob("*.mcap")) if path.is_dir() else [path]
            found = sum(1 for file in files for _ in Recording(file).entries())
        except RecordingError:
            continue  # its first bytes are still to come
