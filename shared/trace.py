"""A recorded course of the velocity reference: a CSV file, replayed over and over."""

from __future__ import annotations

import csv
import hashlib
import sys
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final

import numpy as np

from shared.config import Config, ReferenceConfig
from shared.errors import ConfigError
from shared.robot import Array

COLUMNS: Final = ("t", "vx", "vy", "wz")
_STREAM: Final = 6  # of the seed
_SOURCE: Final = Path(__file__).parents[1] / "deploy" / "scenarios"
_INSTALLED: Final = Path(sys.prefix) / "share" / "quadriga" / "scenarios"


@dataclass(frozen=True, slots=True)
class Trace:
    """Samples of a velocity reference, linear in between.

    Attributes:
        t: times from 0 to the trace's length, shape (m,), s.
        v: vx, vy, wz, shape (m, 3), m/s and rad/s.
        begin: time of the trace at which a walk begins, s.
    """

    t: Array
    v: Array
    begin: float = 0.0

    def at(self, seconds: float) -> tuple[float, float, float]:
        """The vx, vy, wz to walk with `seconds` after the first step."""
        t = (self.begin + seconds) % float(self.t[-1])
        vx, vy, wz = (float(np.interp(t, self.t, column)) for column in self.v.T)
        return vx, vy, wz


def scenario_folder() -> Path:
    """Where scenarios and traces are kept: beside the source, or where it has been installed."""
    return _SOURCE if _SOURCE.is_dir() else _INSTALLED


def trace_of(config: Config) -> Trace | None:
    """The trace of a configuration, None if it has none.

    Raises:
        ConfigError: the file cannot be read, or is no trace.
    """
    path, shift = _path(config), config.reference.trace_shift
    if path is None:
        return None
    begin = np.random.default_rng((config.world.seed, _STREAM)).uniform(0.0, shift)
    return _read(path, begin)


def trace_sha256(config: Config) -> str:
    """Digest of the trace's file, empty without one: a configuration holds only its name.

    Raises:
        ConfigError: the file cannot be read.
    """
    path = _path(config)
    try:
        return "" if path is None else hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise _refused(Path(config.reference.trace), error.strerror or str(error),
                       "a file that can be read") from None  # fmt: skip


def _path(config: Config) -> Path | None:
    name = config.reference.trace
    if not name:
        return None
    return Path(name) if "/" in name else scenario_folder() / name


@lru_cache(maxsize=8)
def _read(path: Path, begin: float) -> Trace:
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "bytes that are not UTF-8"
        raise _refused(path, reason, "a file that can be read") from None
    rows = list(csv.reader(line for line in lines if line.strip() and not line.startswith("#")))
    if not rows or tuple(word.strip() for word in rows[0]) != COLUMNS:
        raise _refused(path, ",".join(rows[0]) if rows else "nothing", ",".join(COLUMNS))
    try:
        values = np.array([[float(word) for word in row] for row in rows[1:]])
    except ValueError as error:
        raise _refused(path, str(error), "four numbers a line") from None
    if values.ndim != 2 or values.shape[1] != len(COLUMNS) or len(values) < 2:
        raise _refused(path, f"numbers of shape {values.shape}", "at least two lines of four")
    _check(path, values)
    values.setflags(write=False)
    return Trace(values[:, 0], values[:, 1:], begin)


def _check(path: Path, values: Array) -> None:
    t = values[:, 0]
    if not np.isfinite(values).all() or t[0] != 0.0 or (np.diff(t) <= 0.0).any():
        raise _refused(path, f"times from {t[0]:g} to {t[-1]:g}", "finite numbers, t rising from 0")
    for column, name in enumerate(COLUMNS[1:], start=1):
        limits = ReferenceConfig.__dataclass_fields__[name].metadata
        low, high = values[:, column].min(), values[:, column].max()
        if low < limits["low"] or high > limits["high"]:
            raise _refused(path, f"{name} of {low:g} … {high:g}",
                           f"{limits['low']:g} … {limits['high']:g} {limits['unit']}")  # fmt: skip


def _refused(path: Path, got: str, expected: str) -> ConfigError:
    return ConfigError(f"reference.trace {path}", got, expected)
