"""What a robot's trunk was to do, was measured to do and did, at the ticks of its measurements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quadriga.recordings.applied_plans import join_applied_samples
from quadriga.recordings.traces import Traces, in_force
from quadriga.recordings.truth import Ticks
from quadriga.shared.robots.conventions import OUTPUTS, Array
from quadriga.shared.topics import SAMPLE_MS


@dataclass(frozen=True, slots=True)
class TrackedOutputs:
    """Outputs z, vx, vy, roll, pitch, wz of a robot, NaN where something is not known.

    Attributes:
        tick: of the robot's measurements, shape (T,), ms.
        true: by the world's truth, shape (T, 6).
        measured: by the robot's own estimate, shape (T, 6).
        planned: for this tick by the plan in force, shape (T, 6).
        reference: vx, vy, wz and height that were asked for, shape (T, 4).
    """

    tick: Ticks
    true: Array
    measured: Array
    planned: Array
    reference: Array


def track_outputs(traces: Traces, index: int) -> TrackedOutputs:
    """The tracked outputs of the robot at `index`."""
    robot, truth = traces.robots[index], traces.truth
    tick, measured = traces.measurements[robot].tick, traces.measurements[robot].y
    begin, _, planned = join_applied_samples(traces.plans[robot], traces.config.planner.applied)
    return TrackedOutputs(
        tick=tick,
        true=_look_up(tick, truth.tick, truth.y[:, index]),
        measured=measured,
        planned=_look_up(tick, np.rint(1000 * begin).astype(np.int64) + SAMPLE_MS, planned),
        reference=in_force(traces.references, tick),
    )


def _look_up(tick: Ticks, known: Ticks, values: Array) -> Array:
    """Rows of `values` at each tick, NaN where none is known. Shape (len(tick), 6)."""
    padded = np.vstack([np.full((1, len(OUTPUTS)), np.nan), values.reshape(-1, len(OUTPUTS))])
    order = np.argsort(known, kind="stable")  # of several for one tick the last counts
    newest = np.searchsorted(known[order], tick, side="right")
    at = np.concatenate([[0], 1 + order])[newest]
    at[(at > 0) & (np.concatenate([[-1], known])[at] != tick)] = 0
    rows: Array = padded[at]
    return rows
