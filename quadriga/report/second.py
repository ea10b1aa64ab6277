"""The second before a trouble: one robot's samples, and what counts as out of the ordinary."""

from __future__ import annotations

from typing import Final

from quadriga.agents.modes import DAMPING, ESTOP
from quadriga.report.moments import FALL, STOP
from quadriga.report.path import spells
from quadriga.report.run import Run
from quadriga.report.samples import Samples
from quadriga.shared.wire.topics import SAMPLE_MS

BEFORE_MS: Final = 1000
TOGETHER_MS: Final = 200  # troubles this close are one episode
TILT: Final = 0.25  # rad; walks on rough ground stay below
SLIP: Final = 0.2  # m/s; feet in stance roll at up to 0.06
TORQUE: Final = 0.98  # share of the limit
_LOST_MS: Final = 40  # ms of scheduled stance without contact
_LIMP: Final = (f"({DAMPING})", f"({ESTOP})")


def window_before(samples: Samples, tick: int) -> Samples:
    """The second up to `tick`."""
    kept = (samples.tick > tick - BEFORE_MS) & (samples.tick <= tick)
    values = [getattr(samples, name)[kept] for name in Samples.__slots__]
    return Samples(*values)


def airborne(window: Samples, leg: int) -> list[tuple[int, int]]:
    """Spells of scheduled stance in which a foot had no ground, if they are long."""
    lost = window.stance[:, leg] & ~window.contact[:, leg]
    return [(a, b) for a, b in spells(lost) if SAMPLE_MS * (b - a) >= _LOST_MS]


def down_since(run: Run, robot: str, tick: int) -> int | None:
    """When a robot went limp, if that was some time before `tick`: then its second says nothing."""
    for moment in run.moments:
        limp = moment.kind == FALL or (moment.kind == STOP and moment.text.endswith(_LIMP))
        if moment.robot == robot and limp and moment.tick < tick - TOGETHER_MS:
            return moment.tick
    return None
