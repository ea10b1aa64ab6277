"""What feet's sensors make of normal forces: counts that are held, drift, and fail for a while."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from quadriga.shared.config.sensors import SensorsConfig
from quadriga.shared.robot.conventions import N_LEGS, Array

MEASURES, READS_ZERO, REPEATS = 0, 1, 2  # what a sensor does at a tick
_TICK: Final = 1e-3  # s

Faults = NDArray[np.int8]


class FootSensors:
    """Scale, offset, refresh rate and dropouts of all feet; each robot has a stream of its own.

    Attributes:
        scale: counts per N, (n, 4).
    """

    def __init__(self, config: SensorsConfig, streams: Sequence[Generator]) -> None:
        self._streams = streams
        shape = (len(streams), N_LEGS)
        spread, bias = np.empty(shape), np.empty(shape)
        for i, stream in enumerate(streams):
            spread[i], bias[i] = stream.standard_normal((2, N_LEGS))
        self.scale = config.foot_scale * np.exp(config.foot_scale_spread * spread)
        self._offset = config.foot_offset + config.foot_bias * bias
        self._refresh = _TICK * config.foot_refresh_rate
        self._drift = config.foot_drift
        self._rate = _TICK * config.foot_dropout_rate
        self._duration = max(1.0, config.foot_dropout_ms)
        # The next dropout of each foot: its first and last tick, and what the sensor then does.
        self._begin, self._end = np.full(shape, np.inf), np.full(shape, -np.inf)
        self._fault = np.zeros(shape, dtype=np.int8)
        self._tick = 0
        for i in range(shape[0]):
            for leg in range(N_LEGS):
                self._draw_dropout(i, leg, 0.0)

    def draw(self, ticks: int) -> tuple[Array, Faults]:
        """Counts of an unloaded foot, and what sensors do, in the next ticks; both (ticks, n, 4).

        Drift goes on from one call to the next; within a block it is a straight line.
        """
        target = self._offset + self._drift * np.sqrt(_TICK * ticks) * np.stack(
            [stream.standard_normal(N_LEGS) for stream in self._streams]
        )
        share = np.arange(1, ticks + 1)[:, None, None] / ticks
        offset = self._offset + share * (target - self._offset)
        self._offset = target
        return offset, self._faults(ticks)

    def _faults(self, ticks: int) -> Faults:
        """What each foot's sensor does in the next ticks, (ticks, n, 4)."""
        first, last = self._tick, self._tick + ticks
        self._tick = last
        count = np.floor(self._refresh * np.arange(first - 1, last))  # of readings so far
        held = np.where(np.diff(count) > 0.0, MEASURES, REPEATS).astype(np.int8)
        faults = np.tile(held[:, None, None], (1, *self._begin.shape))
        for i, leg in np.argwhere(self._begin < last):
            while self._begin[i, leg] < last:
                begin, end = self._begin[i, leg], self._end[i, leg]
                within = slice(max(0, int(begin) - first), max(0, int(min(end, last)) - first))
                faults[within, i, leg] = self._fault[i, leg]
                if end >= last:
                    break
                self._draw_dropout(i, leg, end)
        return faults

    def _draw_dropout(self, i: int, leg: int, after: float) -> None:
        """Draw when a foot's sensor fails next, and how."""
        if self._rate <= 0.0:
            return
        stream = self._streams[i]
        self._begin[i, leg] = after + stream.exponential(1.0 / self._rate)
        self._end[i, leg] = self._begin[i, leg] + 1.0 + stream.exponential(self._duration)
        self._fault[i, leg] = READS_ZERO if stream.random() < 0.5 else REPEATS
