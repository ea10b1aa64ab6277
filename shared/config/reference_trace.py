"""A recorded course of the velocity reference: a CSV file, replayed over and over."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final

import numpy as np

from quadriga.shared.config.sections import Config, ReferenceConfig
from quadriga.shared.errors import ConfigError, name_file_errors
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.places import SCENARIOS

ROW_END: Final = ";"  # where a trace stands in a configuration, in one line
_KEY: Final = "reference.trace"
_HEAD: Final = "t,vx,vy,wz"
_STREAM: Final = 6  # of the seed


@dataclass(frozen=True, slots=True)
class Trace:
    """Samples of a velocity reference, linear in between."""

    t: Array  # times from 0 to the trace's length, shape (m,), s
    v: Array  # vx, vy, wz, shape (m, 3), m/s and rad/s
    begin: float = 0.0  # time of the trace at which a walk begins, s

    def at(self, seconds: float) -> tuple[float, float, float]:
        """The vx, vy, wz to walk with `seconds` after the first step."""
        t = (self.begin + seconds) % float(self.t[-1])
        vx, vy, wz = (float(np.interp(t, self.t, column)) for column in self.v.T)
        return vx, vy, wz


def trace_of(config: Config) -> Trace | None:
    """The trace of a configuration, None if it has none.

    Raises:
        ConfigError: it is no trace.
    """
    asked = config.reference
    if not asked.trace:
        return None
    begin = np.random.default_rng((config.world.seed, _STREAM)).uniform(0.0, asked.trace_shift)
    return _parse_trace(asked.trace, begin)


def inline_trace(name: str) -> str:
    """A trace's file as one line, as `reference.trace` holds it: nothing then depends on the file.

    The name is a path with a `/`, or that of a file beside the scenarios.

    Raises:
        ConfigError: the file cannot be read, or is no trace.
    """
    path = Path(name) if "/" in name else SCENARIOS / name
    with name_file_errors(ConfigError, f"{_KEY} {path}", "a file that can be read"):
        text = path.read_text(encoding="utf-8-sig")  # as spreadsheets write it
    lines = ["".join(line.split()) for line in text.splitlines()]
    lines = [line for line in lines if line and not line.startswith("#")]
    _parse_values(f"{_KEY} {path}", lines)
    return ROW_END.join(lines)


@lru_cache(maxsize=8)
def _parse_trace(text: str, begin: float) -> Trace:
    values = _parse_values(_KEY, text.split(ROW_END))
    values.setflags(write=False)
    return Trace(values[:, 0], values[:, 1:], begin)


def _parse_values(name: str, lines: list[str]) -> Array:
    """Checked lines t, vx, vy, wz; the first of `lines` names them."""
    if not lines or lines[0] != _HEAD:
        raise ConfigError(name, lines[0] if lines else "nothing", _HEAD)
    try:
        values = np.array([[float(word) for word in line.split(",")] for line in lines[1:]])
    except ValueError as error:
        raise ConfigError(name, str(error), "four numbers a line") from None
    if values.ndim != 2 or values.shape[1] != 4 or len(values) < 2:
        raise ConfigError(name, f"numbers of shape {values.shape}", "at least two lines of four")
    t = values[:, 0]
    if not np.isfinite(values).all() or t[0] != 0.0 or (np.diff(t) <= 0.0).any():
        got = f"times from {t[0]:g} to {t[-1]:g}"
        raise ConfigError(name, got, "finite numbers, t rising from 0")
    for column, key in zip(values[:, 1:].T, ("vx", "vy", "wz"), strict=True):
        limits = ReferenceConfig.__dataclass_fields__[key].metadata
        if column.min() < limits["low"] or column.max() > limits["high"]:
            expected = f"{limits['low']:g} … {limits['high']:g} {limits['unit']}"
            raise ConfigError(name, f"{key} of {column.min():g} … {column.max():g}", expected)
    return values
