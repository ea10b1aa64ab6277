"""What an agent counts: whatever was out of the ordinary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from quadriga.agents.controller.whole_body.problem import UNCONSTRAINED, WholeBodySolution
from quadriga.agents.planner.qp_solver import SOLVED
from quadriga.agents.planning.interface import PlanningOutputs
from quadriga.shared.wire.codes import code_of

IMU_BRIDGED: Final = "imu_bridged"
ENCODER_BRIDGED: Final = "encoder_bridged"


def count(
    counters: Mapping[str, int],
    planned: PlanningOutputs,
    solution: WholeBodySolution,
    bridged: Sequence[str],
) -> Mapping[str, int]:
    """The counters after a tick.

    Args:
        counters: before it.
        planned: what planning came to.
        solution: of the whole-body QP.
        bridged: counters of sensors of which something else was believed than was read.
    """
    names = [*bridged]
    if planned.plan is not None and planned.plan.status != SOLVED:
        names.append(f"plan_{code_of(planned.plan.status)}")
    names += planned.unusual
    if solution.status != UNCONSTRAINED:
        names.append("qp_constrained" if solution.solved else "qp_failed")
    if not names:
        return counters
    return {**counters, **{name: counters.get(name, 0) + 1 for name in names}}
