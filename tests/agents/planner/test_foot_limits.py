"""Newton's method on the faces of feet's limits: against DAQP, and with multipliers as proof."""

from __future__ import annotations

from dataclasses import replace

import daqp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.agents.planner import solver as solvers
from quadriga.agents.planner.foot_limits import FAILED, Minimum, minimise
from quadriga.agents.planner.qp import PlannerProblem, residuals
from quadriga.agents.planner.solver import SOLVED, SOLVERS
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import Array
from tests.a1 import build_problem
from tests.agents.counting import count_calls

N = 6
STANCE = np.tile([True, False, False, True], (N, 1))
STANCE[3:] = ~STANCE[3:]
BOXES = [(20.0, 20.0, 60.0), (200.0, 200.0, 400.0), (5.0, 30.0, 60.0)]  # N


def problem_of(
    seed: int,
    box: tuple[float, float, float] = BOXES[0],
    force_min: float = 5.0,
    mu: float = 0.6,
    coupling: float = 0.1,
) -> PlannerProblem:
    """Outputs that follow each force, and some of the others'."""
    planner = replace(Config().planner, N=N, deviation_max=box, force_min=force_min, mu=mu)
    G = np.random.default_rng(seed).normal(size=(6 * N, 12 * N)) * 1e-3 * coupling
    return build_problem(planner, G, STANCE)


def minimum(problem: PlannerProblem, f: Array) -> Minimum:
    return minimise(SOLVERS["daqp"](problem).force_qp, f)


def by_daqp(problem: PlannerProblem, f: Array) -> Array:
    x, _, flag, _ = daqp.solve(
        problem.H,
        f,
        problem.A,
        np.minimum(problem.upper, 1e30),
        np.maximum(problem.lower, -1e30),
        np.zeros(len(problem.upper), dtype=np.intc),
    )
    assert flag == 1
    return np.asarray(x, dtype=np.float64)


@given(
    seed=st.integers(0, 2**32 - 1),
    box=st.sampled_from(BOXES),
    force_min=st.sampled_from([0.0, 5.0, 20.0]),
    mu=st.floats(0.1, 1.5),
    size=st.sampled_from([1.0, 10.0, 100.0, 1e4]),
)
def test_it_is_the_minimiser_of_a_dual_active_set_and_its_multipliers_prove_it(
    seed: int, box: tuple[float, float, float], force_min: float, mu: float, size: float
) -> None:
    """Forces that are asked for far beyond the limits put feet on sides, edges and corners.

    Every condition of optimality is computed from A: gradient, bounds, signs, complementarity.
    """
    problem = problem_of(seed, box, force_min, mu)
    f = -problem.H @ (size * np.random.default_rng(seed).normal(size=len(problem.H)))
    found = minimum(problem, f)
    assert found.solutions != FAILED
    np.testing.assert_allclose(found.v, by_daqp(problem, f), atol=1e-5)
    checked = residuals(problem, f, found.v, found.multipliers)
    assert max(checked) < 1e-8
    np.testing.assert_allclose(found.residuals, checked, atol=1e-10)
    values = np.concatenate([found.v, problem.A @ found.v])
    scale = max(1.0, float(np.abs(f).max()))
    assert (found.multipliers[values < problem.upper - 1e-6] <= 1e-9 * scale).all()
    assert (found.multipliers[values > problem.lower + 1e-6] >= -1e-9 * scale).all()


def test_a_foot_is_held_where_its_pyramid_meets_the_box() -> None:
    """More sideways force needs more upward force up to there, and is of no use beyond."""
    problem = problem_of(0, box=(20.0, 20.0, 60.0), coupling=0.0)
    asked = np.zeros(len(problem.H))
    asked[0], asked[2] = 1000.0, -60.0  # far sideways, and not upwards at all
    found = minimum(problem, -problem.H @ asked)
    side = problem.upper[len(asked)]
    assert found.v[0] == pytest.approx(20.0)
    assert found.v[2] == pytest.approx((20.0 - side) / problem.slope)
    at_box, at_side = found.multipliers[0], found.multipliers[len(asked)]
    assert at_box > 0.0
    assert at_side > 0.0


def test_a_cycle_is_left_to_daqp(monkeypatch: pytest.MonkeyPatch) -> None:
    """Outputs that forces of all feet move as strongly as their own make it cycle."""
    problem = problem_of(1, coupling=10.0)
    f = problem.gradient @ np.random.default_rng(1).normal(size=6 * N)
    assert minimum(problem, f).solutions == FAILED
    solver = SOLVERS["daqp"](problem)
    judged = count_calls(monkeypatch, solvers, "judge")
    solution = solver.solve(f)
    assert (solution.status, len(judged)) == (SOLVED, 1)
    np.testing.assert_allclose(solution.x, by_daqp(problem, f), atol=1e-5)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e200])
def test_what_is_not_finite_has_no_minimiser(bad: float) -> None:
    problem = problem_of(2)
    f = np.zeros(len(problem.H))
    f[3] = bad
    assert minimum(problem, f).solutions == FAILED
