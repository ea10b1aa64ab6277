"""Words below figures, above all where planned and measured differ on purpose."""

from __future__ import annotations

from typing import Final

from quadriga.report.run import ReportedRun

CLIP: Final = (
    "The end of the walk, at most 5 s of it, as fast as the world was. Arrows are the true forces "
    "of the ground on the feet, each robot's in its colour; the gold rods are yokes."
)
SCENE: Final = (
    "Drag to look from another side, turn the wheel to come nearer. Lines from feet are the true "
    "forces of the ground, 3 mm for a newton; a foot in the air is black. Fifty pictures a second."
)
PATHS: Final = "Dots are the trunks at the times that are written beside them."
TIMES: Final = (
    "By the wall clock. Medians, quantiles and maxima leave out the first solve of each process, "
    "which the curve has."
)
_ESTIMATE: Final = (
    "The agent knows its own estimate alone, and its plans begin there: what is planned follows "
    "the estimate, not the truth."
)
_HEIGHTS: Final = (
    " The agent's height is that over the feet that stand, the true one that over the terrain "
    "under the hips."
)
_FORCES: Final = {  # by `planner.interface`
    "feedforward": "Planned and true forces differ on purpose. Of a plan only what departs from "
    "nominal forces is handed on, as an acceleration of the trunk, which feedback keeps steady "
    "meanwhile; the whole-body controller chooses the forces anew every millisecond.",
    "force": "Planned and true forces differ: the whole-body controller tracks planned ones, which "
    "hold for 10 ms, as far as balance, friction and motors let it, anew every millisecond.",
}


def outputs(run: ReportedRun) -> str:
    """Below an agent's outputs, where the truth stands beside them."""
    return _ESTIMATE + _HEIGHTS if run.has_truth else ""


def forces(run: ReportedRun) -> str:
    """Below the forces of feet, where there are planned ones."""
    if not run.has_truth or not any(run.traces.plans.values()):
        return ""
    return _FORCES.get(run.traces.config.planner.interface, "")
