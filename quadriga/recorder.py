"""SHELL of the recorder process: everything on the team's keys goes into one MCAP file."""

from __future__ import annotations

import contextlib
import importlib.metadata
import json
import platform
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Final

from shared.barrier import RECORDER, SIM, meet
from shared.bus import HERE, POLL, READY, Bus
from shared.clock import monotonic, sleep, wall_ns
from shared.config import Config
from shared.config_text import config_sha256
from shared.errors import RecordingError
from shared.recording import RecordingWriter
from shared.signals import stop_on_signals

FLUSH: Final = 0.1  # s wall, a kill loses no more than this
QUIET: Final = 0.2  # s wall without a message after which nothing more is under way
DRAIN_LIMIT: Final = 5.0  # s wall, longest drain of a team that does not fall silent
_GATHER: Final = 0.002  # s wall, pause between looks at the inbox: one wake-up for many messages
_PACKAGES: Final = (
    "quadriga", "eclipse-zenoh", "mujoco", "pin", "numpy", "daqp", "osqp", "numba", "msgpack",
)  # fmt: skip


def run(
    config: Config,
    path: Path,
    *,
    predictor_sha256: str = "",
    stopped: Callable[[], bool] | None = None,
) -> None:
    """Record until SIGINT, SIGTERM or the sim server's leaving; then drain and finish the file.

    A message's log time is when it was taken from the inbox, some 2 ms after its reception.

    Args:
        config: the team's configuration, stored with the recording.
        path: the file to write; it must not exist.
        predictor_sha256: hash of the predictor the team walks with, stored as well.
        stopped: asked often whether to stop; by default a flag that the two signals raise.

    Raises:
        RecordingError: the file cannot be written.
        BusError: the bus cannot be opened, or the team did not assemble in time.
    """
    stopped = stopped or stop_on_signals()
    about = metadata(config, predictor_sha256)
    try:
        with (
            Bus.open(config.bus, config.team.name, RECORDER, stopped) as bus,
            RecordingWriter(path, about, config.recorder.chunk_kib) as to,
        ):
            bus.subscribe(f"{config.team.name}/**")
            if meet(bus, config, stopped):
                bus.declare(READY)
                _record(bus, to, lambda: stopped() or SIM not in bus.present(HERE))
            _drain(bus, to)
    except OSError as error:
        raise RecordingError(
            str(path), error.strerror or str(error), "room for the recording"
        ) from None


def metadata(config: Config, predictor_sha256: str) -> dict[str, str]:
    """What a recording says of itself; `Recording.metadata` hands it back."""
    return {
        "team": config.team.name,
        "config_json": json.dumps(asdict(config), sort_keys=True),
        "config_sha256": config_sha256(config),
        "predictor_sha256": predictor_sha256,
        "versions": json.dumps(versions()),
    }


def _record(bus: Bus, to: RecordingWriter, ended: Callable[[], bool]) -> None:
    flushed = monotonic()
    while not ended():
        _take(bus, to, POLL)
        if monotonic() - flushed > FLUSH:
            to.flush()
            flushed = monotonic()
        sleep(_GATHER)


def _drain(bus: Bus, to: RecordingWriter) -> None:
    """What was sent before the end may still be under way when the end is noticed."""
    limit = monotonic() + DRAIN_LIMIT
    while _take(bus, to, QUIET) and monotonic() < limit:
        pass


def _take(bus: Bus, to: RecordingWriter, timeout: float) -> bool:
    """Write all that has arrived; False if nothing came within `timeout` seconds."""
    first = bus.get(timeout)
    if first is None:
        return False
    now = wall_ns()
    for key, payload in (first, *bus.drain()):
        to.write(key, payload, now)
    return True


def versions() -> dict[str, str]:
    """Versions of what a run's figures depend on."""
    found = {"python": platform.python_version(), "machine": platform.machine()}
    for package in _PACKAGES:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            found[package] = importlib.metadata.version(package)
    return found
