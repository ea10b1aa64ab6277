"""The QP of a tick at which a limit is active, as a flat row from compiled code to the solver."""

from __future__ import annotations

from typing import Final, NamedTuple

import daqp
import numpy as np

from quadriga.agents.controller.maths.dense import dot
from quadriga.agents.controller.maths.rows import places, row_size
from quadriga.agents.controller.whole_body.problem import (
    CONSTRAINED,
    INFEASIBLE,
    SOLUTION_SIZE,
    WholeBodyProblem,
)
from quadriga.shared.codes import with_detail
from quadriga.shared.robots.conventions import N_FORCES, N_JOINTS, N_LEGS, Array
from quadriga.shared.runtime.jit import compiled

_UNBOUNDED: Final = 1e30  # DAQP's infinity
_OPTIMAL: Final = 1  # DAQP's flag
_CONE: Final = 5  # rows of a foot's friction cone
_OUTPUTS: Final = 18  # of a robot of which no foot is in contact


class LimitedLayout(NamedTuple):
    """Where the row keeps the solution and, if a limit is active, the `WholeBodyProblem`.

    Matrices are kept row by row. Of C, A, a0, B and defect0 the first ones are filled, as many as
    feet in contact ask for.

    Attributes:
        x: see `WholeBodySolution`.
        lower: τ_min, then c.
        upper: τ_max, then nothing that bounds.
    """

    x: slice
    H: slice
    g: slice
    C: slice
    lower: slice
    upper: slice
    A: slice
    a0: slice
    B: slice
    defect0: slice


LIMITED: Final = LimitedLayout(
    **places(
        x=SOLUTION_SIZE,
        H=N_JOINTS * N_JOINTS,
        g=N_JOINTS,
        C=_CONE * N_LEGS * N_JOINTS,
        lower=N_JOINTS + _CONE * N_LEGS,
        upper=N_JOINTS + _CONE * N_LEGS,
        A=N_FORCES * N_JOINTS,
        a0=N_FORCES,
        B=_OUTPUTS * N_JOINTS,
        defect0=_OUTPUTS,
    )
)
LIMITED_SIZE: Final = row_size(LIMITED)


@compiled
def fill_limited(problem: WholeBodyProblem, row: Array) -> None:
    """Write a problem into a row, (LIMITED_SIZE,)."""
    cones, forces, outputs = len(problem.c), len(problem.a0), len(problem.defect0)
    row[LIMITED.H] = problem.H.ravel()
    row[LIMITED.g] = problem.g
    row[LIMITED.C][: N_JOINTS * cones] = problem.C.ravel()
    lower, upper = row[LIMITED.lower], row[LIMITED.upper]
    lower[:N_JOINTS], upper[:N_JOINTS] = problem.tau_min, problem.tau_max
    lower[N_JOINTS : N_JOINTS + cones] = problem.c
    upper[N_JOINTS:] = _UNBOUNDED
    row[LIMITED.A][: N_JOINTS * forces] = problem.A.ravel()
    row[LIMITED.a0][:forces] = problem.a0
    row[LIMITED.B][: N_JOINTS * outputs] = problem.B.ravel()
    row[LIMITED.defect0][:outputs] = problem.defect0


def solve_limited(row: Array, contact: Array) -> str:
    """Solve the QP of a row with an active set (DAQP); the status, see `WholeBodySolution`.

    Args:
        row: see `LimitedLayout`; its x is that of the closed form, whose NaN say that the problem
            is singular, and becomes the solution.
        contact: 1 for the feet that push, (4,).
    """
    if not np.isfinite(row[LIMITED.x][:N_JOINTS]).all():
        tau, status = np.zeros(N_JOINTS), with_detail(INFEASIBLE, "singular")
    else:
        tau, status = _solve(row, _CONE * int(np.count_nonzero(contact > 0.5)))
    _imply_limited(row, contact, tau)
    return status


def _solve(row: Array, cones: int) -> tuple[Array, str]:
    """The optimal torques, zero where there are none, and the status."""
    lower, upper = row[LIMITED.lower], row[LIMITED.upper]
    tau, _, flag, _ = daqp.solve(
        row[LIMITED.H].reshape(N_JOINTS, N_JOINTS),
        row[LIMITED.g],
        row[LIMITED.C][: N_JOINTS * cones].reshape(cones, N_JOINTS),
        upper[: N_JOINTS + cones],
        lower[: N_JOINTS + cones],
        np.zeros(N_JOINTS + cones, dtype=np.intc),
    )
    if flag != _OPTIMAL or not np.isfinite(tau).all():
        return np.zeros(N_JOINTS), with_detail(INFEASIBLE, str(flag))
    return np.clip(tau, lower[:N_JOINTS], upper[:N_JOINTS]), CONSTRAINED


@compiled
def _imply_limited(row: Array, contact: Array, tau: Array) -> None:
    """Fill torques, forces and defect of a row's problem, see `imply`."""
    A, B = row[LIMITED.A].reshape(N_FORCES, N_JOINTS), row[LIMITED.B].reshape(_OUTPUTS, N_JOINTS)
    forces = 3 * int(np.sum(contact > 0.5))
    outputs = _OUTPUTS - forces
    imply(
        A[:forces],
        row[LIMITED.a0][:forces],
        B[:outputs],
        row[LIMITED.defect0][:outputs],
        contact,
        tau,
        row[LIMITED.x],
    )


@compiled
def imply(
    A: Array, a0: Array, B: Array, defect0: Array, contact: Array, tau: Array, x: Array
) -> None:
    """Fill torques, forces and defect, see `WholeBodySolution`; the others are zero.

    Args:
        A: as a0, B and defect0 in `WholeBodyProblem`.
        a0: see A.
        B: see A.
        defect0: see A.
        contact: 1 for the feet that push, (4,).
        tau: torques, (12,), N·m.
        x: (42,), filled.
    """
    x[:] = 0.0
    x[:12] = tau
    row = 0
    for leg in range(4):
        if contact[leg] > 0.5:
            for axis in range(3):
                x[12 + 3 * leg + axis] = dot(A[row + axis], tau) + a0[row + axis]
            row += 3
    for k in range(len(defect0)):
        x[24 + k] = dot(B[k], tau) + defect0[k]
