"""The second before a trouble: one robot's samples, and what counts as out of the ordinary."""

from __future__ import annotations

from typing import Final

from quadriga.charts.thinning import find_spells
from quadriga.report.run import ReportedRun
from quadriga.report.samples import Samples
from quadriga.shared.topics import SAMPLE_MS

BEFORE_MS: Final = 1000
TOGETHER_MS: Final = 200  # troubles this close are one episode
TILT: Final = 0.25  # rad; walks on rough ground stay below
SLIP: Final = 0.2  # m/s; feet in stance roll at up to 0.06
TORQUE: Final = 0.98  # share of the limit
YOKE: Final = 0.5  # of a robot's weight, force in a yoke; on even ground it stays below 0.15
_LOST_MS: Final = 40  # ms of scheduled stance without contact


def cut_window(samples: Samples, tick: int) -> Samples:
    """The second up to `tick`."""
    kept = (samples.tick > tick - BEFORE_MS) & (samples.tick <= tick)
    values = [getattr(samples, name)[kept] for name in Samples.__slots__]
    return Samples(*values)


def find_lost_stance(window: Samples, leg: int) -> list[tuple[int, int]]:
    """Long spells of scheduled stance in which a foot had no ground: first index, index after."""
    lost = window.stance[:, leg] & ~window.contact[:, leg]
    return [(a, b) for a, b in find_spells(lost) if SAMPLE_MS * (b - a) >= _LOST_MS]


def passive_since(run: ReportedRun, robot: str, tick: int) -> int | None:
    """When a robot fell or went passive, if well before `tick`: its second says nothing then."""
    for entry in run.timeline:
        if entry.robot == robot and entry.passive and entry.tick < tick - TOGETHER_MS:
            return entry.tick
    return None
