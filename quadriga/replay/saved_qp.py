"""A quadratic program out of one step of an agent, saved so that it can be solved on its own.

    min ½ xᵀ H x + fᵀ x   s.t.  lower ≤ [x; A x] ≤ upper

A saved file is an .npz with these arrays, `x` (what the agent made of it) and `about` (text):

    qp = np.load("r2-12300-plan.npz")
    x, cost, flag, info = daqp.solve(qp["H"], qp["f"], qp["A"], qp["upper"], qp["lower"],
                                     np.zeros(len(qp["upper"]), dtype=np.intc))

or `python -m quadriga.replay.saved_qp FILE`, which does just that and says how far `x` is from it.
"""

from __future__ import annotations

import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import daqp
import numpy as np

from quadriga.agents.agent import Agent, AgentState, Inputs
from quadriga.agents.controller.whole_body_qp import WholeBodySolution
from quadriga.agents.planner.solver import SolvedQp
from quadriga.shared.errors import RecordingError, name_file_errors
from quadriga.shared.robots.conventions import N_JOINTS, Array
from quadriga.shared.runtime.npz import UNREADABLE, as_measured, open_npz

WHOLE_BODY: Final = "command"  # the topic that is made of it
PLANNER: Final = "plan"
_FAR: Final = 1e30  # DAQP's infinity
_AXES: Final = {"H": 2, "f": 1, "A": 2, "lower": 1, "upper": 1, "x": 1}


@dataclass(frozen=True, slots=True)
class SavedQp:
    """One problem and the answer it got; shapes as above, `x` of the whole-body QP in N·m."""

    H: Array
    f: Array
    A: Array
    lower: Array
    upper: Array
    x: Array
    about: str

    def solve(self) -> Array:
        """The minimiser by a dense dual active set.

        Raises:
            RecordingError: there is none.
        """
        x, _, flag, _ = daqp.solve(
            self.H, self.f, self.A, self.upper, self.lower, np.zeros(len(self.upper), np.intc)
        )
        if flag != 1:
            raise RecordingError(self.about, f"no solution (DAQP says {flag})", "one")
        return np.asarray(x)


def save(path: Path, qp: SavedQp) -> None:
    """Write a problem.

    Raises:
        RecordingError: it cannot be written.
    """
    arrays: dict[str, Any] = asdict(qp)
    with name_file_errors(RecordingError, path, "a new file"):
        np.savez(path, **arrays)


def load(path: Path) -> SavedQp:
    """Read a problem.

    Raises:
        RecordingError: no such file, or not a problem.
    """
    try:
        with open_npz(path) as archive:
            arrays = {
                name: as_measured(name, archive[name], axes, gaps=name == "x", most=_FAR)
                for name, axes in _AXES.items()
            }
            n, rows = len(arrays["f"]), len(arrays["A"])
            expected = ((n, n), (n,), (rows, n), (n + rows,), (n + rows,), (n,))
            if not n or tuple(array.shape for array in arrays.values()) != expected:
                raise ValueError(f"a problem of {n} unknowns and {rows} rows that are others")
            return SavedQp(**arrays, about=str(archive["about"]))
    except UNREADABLE as error:
        raise RecordingError(str(path), str(error) or "another file", "a saved problem") from None


def problems_of(agent: Agent, before: AgentState, inputs: Inputs, about: str) -> dict[str, SavedQp]:
    """The problems behind one step of an agent, by the topic that is made of each.

    None is behind a step by which a robot gets up.

    Args:
        agent: whose step it is.
        before: what it remembered.
        inputs: what it took in.
        about: which step this is, in words.
    """
    posed = agent.problems_of(before, inputs)
    if posed is None:
        return {}
    whole_body, planner = posed
    saved = {WHOLE_BODY: _save_whole_body(whole_body, about)}
    if planner is not None:
        saved[PLANNER] = _save_planner(planner, about)
    return saved


def _save_whole_body(qp: WholeBodySolution, about: str) -> SavedQp:
    cones = 5 * qp.feet  # the other rows do not exist without more feet in contact
    rows = N_JOINTS + cones
    return SavedQp(
        qp.H,
        qp.g,
        qp.C[:cones],
        qp.lower[:rows],
        qp.upper[:rows],
        qp.tau,
        f"whole-body QP of {about}, {qp.status}: x is the torques [N·m]",
    )


def _save_planner(qp: SolvedQp, about: str) -> SavedQp:
    return SavedQp(
        qp.problem.H,
        qp.f,
        qp.problem.A,
        np.maximum(qp.problem.lower, -_FAR),
        np.minimum(qp.problem.upper, _FAR),
        qp.solution.x,
        f"planner's QP of {about}, {qp.solution.status}: x is the force deviations of the "
        "stance legs over the horizon [N]",
    )


def main(path: Path) -> None:
    """Solve a saved problem and compare."""
    qp = load(path)
    x = qp.solve()
    print(f"{qp.about}\n{len(x)} unknowns, {len(qp.A)} rows")
    print(f"x = {np.array2string(x, precision=4, threshold=24)}")
    print(f"greatest difference from the agent's answer: {np.abs(x - qp.x).max():.3g}")


if __name__ == "__main__":
    try:
        main(Path(sys.argv[1]))
    except RecordingError as wrong:
        sys.exit(f"saved_qp: {wrong}")
    except IndexError:
        sys.exit("usage: python -m quadriga.replay.saved_qp FILE")
