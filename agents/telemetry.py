"""An agent's account of itself: wall-clock times gathered between two status messages."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from quadriga.agents.step_io import Outputs
from quadriga.shared.messages import Status
from quadriga.shared.modes import WALK
from quadriga.shared.runtime.histogram import Histogram

PERIOD_MS: Final = 100
_BIN_MS: Final = 0.02


class Telemetry:
    """Collects what the next status message says; one is due at 10 Hz and on change of mode.

    The walk is `paced` in real time, so that it matters when a tick is answered, or not.
    """

    def __init__(self, estimator: str, *, paced: bool = False) -> None:
        self._estimator, self._paced = estimator, paced
        self._jitter = Histogram(_BIN_MS)
        self._newest_state = (-1, 0)  # tick and wall-clock time of the newest state
        self._mode = ("", "")
        self._planner_ms: list[float] = []
        self._tick_us: list[float] = []
        self._last = -PERIOD_MS
        self._ages_ms: dict[str, float] = {}  # each as it was last in this walk

    def note_answer(self, tick_ns: int) -> None:
        """Add one tick, by its wall-clock time from a state to having sent the command."""
        self._tick_us.append(1e-3 * tick_ns)

    def note_step(self, outputs: Outputs) -> None:
        """Add what the agent's step gave."""
        if outputs.mode != WALK:
            self._ages_ms.clear()  # a plan that ended the walk is none that the next one uses
        self._ages_ms.update(outputs.ages_ms)
        if outputs.planner_ns is not None:
            self._planner_ms.append(1e-6 * outputs.planner_ns)

    def note_state(self, tick: int, wall_ns: int) -> None:
        """Add a state of world time `tick`, received at `wall_ns` of a steady clock."""
        last, before = self._newest_state
        self._newest_state = tick, wall_ns
        if self._paced and last >= 0:
            self._jitter.add(abs(1e-6 * (wall_ns - before) - (tick - last)))

    def status(self, tick: int, outputs: Outputs, counters: Mapping[str, int]) -> Status | None:
        """The status message if one is due, with the agent's own counters and `counters`."""
        mode = (outputs.mode, outputs.reason)
        if mode == self._mode and tick < self._last + PERIOD_MS:
            return None
        self._mode, self._last = mode, tick - tick % PERIOD_MS
        status = Status(
            tick,
            tick * 1_000_000,
            *mode,
            self._estimator,
            {**self._ages_ms, **self._jitter.quantiles("jitter")},
            {**outputs.counters, **counters},
            np.array(self._planner_ms),
            np.array(self._tick_us),
        )
        self._planner_ms, self._tick_us = [], []
        return status
