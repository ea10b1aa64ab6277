"""What an agent counts: whatever was out of the ordinary."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from quadriga.agents.controller.whole_body_qp import UNCONSTRAINED, WholeBodySolution
from quadriga.agents.planner.solver import SOLVED
from quadriga.agents.planning.interface import PlanningOutputs
from quadriga.agents.validate import Validated
from quadriga.shared.codes import code_of

IMU_INVALID: Final = "imu_invalid"
ENCODER_INVALID: Final = "encoder_invalid"


def count(
    counters: Mapping[str, int],
    planned: PlanningOutputs,
    solution: WholeBodySolution,
    read: Validated,
) -> Mapping[str, int]:
    """The counters after a tick.

    Args:
        counters: before it.
        planned: what planning came to.
        solution: of the whole-body QP.
        read: the readings of its sensors.
    """
    invalid = ((IMU_INVALID, read.imu), (ENCODER_INVALID, bool(read.encoders)))
    names = [name for name, counts in invalid if counts]
    if planned.plan is not None and planned.plan.status != SOLVED:
        names.append(f"plan_{code_of(planned.plan.status)}")
    names += planned.unusual
    if solution.status != UNCONSTRAINED:
        names.append("qp_constrained" if solution.solved else "qp_failed")
    if not names:
        return counters
    return {**counters, **{name: counters.get(name, 0) + 1 for name in names}}
