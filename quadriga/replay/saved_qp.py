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
import zipfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import daqp
import numpy as np

from quadriga.agents.controller.controller import Controller, ControllerOutputs
from quadriga.agents.controller.sensed import Sensed
from quadriga.agents.planner.free_step import FreeStep
from quadriga.agents.planner.qp_solver import SOLVERS
from quadriga.shared.errors import RecordingError
from quadriga.shared.robot.a1 import TORQUE_LIMIT, Array

WHOLE_BODY: Final = "command"  # the topic that is made of it
PLANNER: Final = "plan"
_FAR: Final = 1e30  # DAQP's infinity


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
    try:
        np.savez(
            path,
            H=qp.H,
            f=qp.f,
            A=qp.A,
            lower=qp.lower,
            upper=qp.upper,
            x=qp.x,
            about=np.array(qp.about),
        )
    except OSError as error:
        raise RecordingError(str(path), error.strerror or str(error), "a new file") from None


def load(path: Path) -> SavedQp:
    """Read a problem.

    Raises:
        RecordingError: no such file, or not a problem.
    """
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in ("H", "f", "A", "lower", "upper", "x")}
            return SavedQp(**arrays, about=str(archive["about"]))
    except (OSError, ValueError, TypeError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise RecordingError(str(path), str(error) or "another file", "a saved problem") from None


@contextmanager
def captured(about: str) -> Iterator[dict[str, SavedQp]]:
    """Collect the problems solved within the block, the last of each kind, by topic.

    For making one step again, never for walking: it stands in for the solvers' functions.
    """
    found: dict[str, SavedQp] = {}

    def whole_body(act: Callable[..., ControllerOutputs]) -> Callable[..., ControllerOutputs]:
        def observed(
            low_level: Controller, seen: Sensed, *arguments: Any, **named: Any
        ) -> ControllerOutputs:
            acted = act(low_level, seen, *arguments, **named)
            problem = low_level.problem(seen, acted.memory, acted.goal)
            box = np.full(len(problem.H), TORQUE_LIMIT)
            found[WHOLE_BODY] = SavedQp(
                problem.H,
                problem.g,
                problem.C,
                np.concatenate([-box, problem.c]),
                np.concatenate([box, np.full(len(problem.c), _FAR)]),
                acted.solution.tau,
                f"whole-body QP of {about}, {acted.solution.status}: x is the torques [N·m]",
            )
            return acted

        return observed

    def planner(solve: Callable[..., Any]) -> Callable[..., Any]:
        def observed(
            solver: Any, f: Array, lower: Array | None = None, upper: Array | None = None
        ) -> Any:
            answer, problem = solve(solver, f, lower, upper), solver._problem
            low = problem.lower if lower is None else lower
            high = problem.upper if upper is None else upper
            found[PLANNER] = SavedQp(
                problem.H,
                f,
                problem.A,
                np.maximum(low, -_FAR),
                np.minimum(high, _FAR),
                answer.x,
                f"planner's QP of {about}, {answer.status}: x is the force deviations of the "
                "stance legs over the horizon [N], then slacks",
            )
            return answer

        return observed

    with ExitStack() as stack:
        stack.enter_context(_instead(Controller, "act", whole_body))
        # Every step through a solver, also those that need none.
        stack.enter_context(_instead(FreeStep, "plan", lambda _: lambda *_: None))
        for kind in SOLVERS.values():
            stack.enter_context(_instead(kind, "solve", planner))
        yield found


@contextmanager
def _instead(
    owner: Any, name: str, wrapped: Callable[[Callable[..., Any]], Callable[..., Any]]
) -> Iterator[None]:
    original = getattr(owner, name)
    setattr(owner, name, wrapped(original))
    try:
        yield
    finally:
        setattr(owner, name, original)


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
