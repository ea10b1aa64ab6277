"""From 1 kHz ticks to the 100 Hz samples that planners and datasets use."""

from __future__ import annotations

from quadriga.shared.robot.a1 import Array
from quadriga.shared.wire.messages import Measurement


def measured(tick: int, force: Array, outputs: Array, stance: Array) -> Measurement:
    """The sample that ends at `tick`.

    Args:
        tick: its last tick, ms.
        force: planned forces, their mean over the sample, yaw frame, shape (12,), N.
        outputs: y at its last tick, yaw frame, shape (6,).
        stance: which feet were to stand in it, shape (4,).
    """
    return Measurement(tick, tick * 1_000_000, force, outputs, stance)
