"""From 1 kHz ticks to the 100 Hz samples that planners and datasets use."""

from __future__ import annotations

from shared.messages import Measurement
from shared.robot import Array


def measured(tick: int, force: Array, outputs: Array, stance: Array) -> Measurement:
    """The sample that ends at `tick`, with the mean force over it.

    Where states were passed over, the mean is over those of its ticks at which the agent stepped:
    the forces changed little between them, while a window without the sample would be of no use.
    There is none if its end was passed over, or all of it.
    """
    return Measurement(tick, tick * 1_000_000, force, outputs, stance)
