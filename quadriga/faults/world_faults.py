"""Faults of the world that is gone: its robots have no power any more, and all others leave."""

from __future__ import annotations

import os
import signal
from typing import Final

from quadriga.faults.fault import FaultScene, TeamFault, strike_with
from quadriga.shared.members import SIM


class _Loss:
    """Take the world from a team."""

    def __init__(self, number: signal.Signals) -> None:
        self._number = number

    def __call__(self, scene: FaultScene) -> None:
        scene.struck.add(SIM)
        os.kill(scene.launch.pids[SIM], self._number)


WORLD_FAULTS: Final = (
    TeamFault("sim-killed", "the world is killed", strike_with(_Loss(signal.SIGKILL))),
    TeamFault("sim-frozen", "the world stands still for good", strike_with(_Loss(signal.SIGSTOP))),
)
"""In the order of the table."""
