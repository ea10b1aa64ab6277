"""The forces that robots planned, at any time of a recording."""

from __future__ import annotations

import numpy as np

from quadriga.recordings.applied_plans import join_applied_samples
from quadriga.recordings.traces import Traces
from quadriga.shared.robots.conventions import Array
from quadriga.shared.topics import SAMPLE_MS


class PlannedForces:
    """The samples of plans that were applied, by the tick at which each begins."""

    def __init__(self, traces: Traces) -> None:
        """Take what is known of the plans."""
        self._samples = {}
        for robot, plans in traces.plans.items():
            begin, forces, _ = join_applied_samples(plans, traces.config.planner.applied)
            ticks = np.rint(1000.0 * begin).astype(np.int64)
            order = np.argsort(ticks, kind="stable")
            self._samples[robot] = ticks[order], forces[order]

    def at(self, tick: int) -> dict[str, Array]:
        """Forces (12,) [N, yaw frame] of each robot that had planned for this tick."""
        found = {}
        for robot, (ticks, forces) in self._samples.items():
            k = int(np.searchsorted(ticks, tick, side="right")) - 1
            if k >= 0 and tick - ticks[k] < SAMPLE_MS:
                found[robot] = forces[k]
        return found
