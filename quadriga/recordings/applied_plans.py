"""The parts of the plans that robots followed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from quadriga.shared.messages import Plan
from quadriga.shared.robots.conventions import N_FORCES, OUTPUTS, Array
from quadriga.shared.topics import SAMPLE_MS


def join_applied_samples(plans: Sequence[Plan], applied: int) -> tuple[Array, Array, Array]:
    """The samples of each plan that were applied, one after the other.

    Args:
        plans: plans of one robot, in ascending order of step.
        applied: samples applied of each.

    Returns:
        Time at which each sample begins (k,), s; its forces (k, 12), N, held for 10 ms; and the
        outputs planned for its end (k, 6). A plan shorter than `applied` is passed over.
    """
    plans = [plan for plan in plans if len(plan.u) >= applied]
    if not plans:
        return np.zeros(0), np.zeros((0, N_FORCES)), np.zeros((0, len(OUTPUTS)))
    begin = [plan.tick + SAMPLE_MS * np.arange(applied) for plan in plans]
    return (
        np.concatenate(begin) / 1000.0,
        np.concatenate([plan.u[:applied] for plan in plans]),
        np.concatenate([plan.y[:applied] for plan in plans]),
    )
