"""The local QP: against independent solutions, its constraints, its typed failures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from quadriga.agents.gait import horizon_stance
from quadriga.agents.planner.qp import PlannerProblem, residuals, unpack
from quadriga.agents.planner.solver import SOLVED, SOLVERS, DaqpSolver, judge
from quadriga.shared.config.sections import Config, PlannerConfig
from quadriga.shared.robots.conventions import Array
from tests.a1 import build_problem, nominal_forces

N = 8
PLANNER = replace(Config().planner, N=N)
CONFIG = replace(Config(), planner=PLANNER)


def response(seed: int) -> Array:
    """A causal response of outputs to forces of the size a trunk's has. Shape (6 N, 12 N)."""
    G = np.random.default_rng(seed).normal(size=(N, 6, N, 12)) * 1e-4
    G *= np.array([1.0, 30.0, 30.0, 10.0, 10.0, 30.0])[None, :, None, None]
    causal = np.arange(N)[:, None] >= np.arange(N)[None, :]
    return (G * causal[:, None, :, None]).reshape(6 * N, 12 * N)


def stance_of(step: int) -> NDArray[np.bool_]:
    return horizon_stance(CONFIG, 0, step)


def problem_of(seed: int, step: int = 20, planner: PlannerConfig = PLANNER) -> PlannerProblem:
    return build_problem(planner, response(seed), stance_of(step))


def solver_of(problem: PlannerProblem, name: str = "daqp") -> DaqpSolver:
    return SOLVERS[name](problem)


def test_the_condensed_cost_is_that_of_equation_12() -> None:
    """½ vᵀHv + fᵀv is half of Σ ‖y − y_des‖²_Q + ‖u − u_des‖²_R up to a constant."""
    rng = np.random.default_rng(0)
    G_u, stance, y_free, y_des = response(1), stance_of(20), *rng.normal(size=(2, 6 * N)) * 0.01
    problem = build_problem(PLANNER, G_u, stance)
    f = problem.gradient @ (y_free - y_des)

    def condensed(v: Array) -> float:
        return float(0.5 * v @ problem.H @ v + f @ v)

    def written_out(v: Array) -> float:
        du, dy = unpack(problem, v, y_free)
        np.testing.assert_allclose(dy.ravel(), y_free + G_u @ du.ravel(), atol=1e-12)
        error = dy - y_des.reshape(N, 6)
        return float((error**2 @ PLANNER.Q).sum() + (du.reshape(N, 4, 3) ** 2 @ PLANNER.R).sum())

    zero = np.zeros(len(problem.H))
    for _ in range(5):
        v = 20.0 * rng.normal(size=len(problem.H))
        expected = 0.5 * (written_out(v) - written_out(zero))
        assert condensed(v) == pytest.approx(expected, rel=1e-9)


def test_daqp_and_osqp_agree() -> None:
    for seed, size in ((4, 0.002), (5, 0.02), (6, 0.1)):
        problem = problem_of(seed)
        f = problem.gradient @ (size * np.random.default_rng(seed).normal(size=6 * N))
        daqp, osqp = (solver_of(problem, name).solve(f) for name in SOLVERS)
        assert (daqp.status, osqp.status) == (SOLVED, SOLVED)
        np.testing.assert_allclose(daqp.x, osqp.x, atol=1e-4)


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    step=st.integers(0, 30),
    size=st.sampled_from([1e-4, 1e-2, 0.1, 1.0, 10.0]),
    mu=st.floats(0.1, 1.5),
)
def test_every_answer_is_feasible_and_optimal(seed: int, step: int, size: float, mu: float) -> None:
    planner, stance = replace(PLANNER, mu=mu), stance_of(step)
    problem = build_problem(planner, response(seed), stance)
    y_free = size * np.random.default_rng(seed).normal(size=6 * N)
    f = problem.gradient @ y_free
    solution = solver_of(problem).solve(f)
    assert solution.status == SOLVED
    found = residuals(problem, f, solution.x, solution.multipliers)
    reported = solution.residuals  # of the closed form a bound
    assert found.stationarity <= reported.stationarity * (1.0 + 1e-6) + 1e-12
    assert reported.stationarity < 1e-8
    np.testing.assert_allclose(reported[1:], found[1:], rtol=1e-6, atol=1e-12)
    assert found.complementarity < 1e-6
    du, _ = unpack(problem, solution.x, y_free)
    force = (nominal_forces(stance) + du).reshape(N, 4, 3)
    assert (force[~stance] == 0.0).all()
    fx, fy, fz = np.moveaxis(force[stance], -1, 0)
    limit = mu / np.sqrt(2.0) * fz + 1e-6
    assert (fz >= -1e-6).all()
    assert (np.abs(fx) <= limit).all()
    assert (np.abs(fy) <= limit).all()
    assert (np.abs(du.reshape(N, 4, 3)) <= np.array(PLANNER.deviation_max) + 1e-6).all()


def test_residuals_see_what_is_wrong() -> None:
    """Each condition of optimality, violated on its own, shows in its own figure."""
    problem = problem_of(7)
    f = problem.gradient @ (0.05 * np.random.default_rng(7).normal(size=6 * N))
    good = solver_of(problem).solve(f)
    far = good.x + 100.0 * (np.arange(len(f)) == 0)
    assert residuals(problem, f, far, good.multipliers).primal > 10.0
    none = np.zeros_like(good.multipliers)
    assert residuals(problem, f, good.x, none).stationarity > 1e-3
    slack = good.multipliers.copy()
    slack[np.flatnonzero(slack == 0)[0]] = 1e3
    assert residuals(problem, f, good.x, slack).complementarity > 1e-3
    nowhere = np.where(np.arange(len(f)) == 1, np.nan, good.x)
    unknown = residuals(problem, f, nowhere, good.multipliers)
    assert np.isnan([unknown.stationarity, unknown.primal]).all()


@pytest.mark.parametrize("name", sorted(SOLVERS))
def test_an_answer_depends_on_f_alone(name: str) -> None:
    """Same bits whatever was solved before, so that a replay may start anywhere."""
    problem = problem_of(8)
    rng = np.random.default_rng(8)
    sizes = (1e-4, 1e-2, 0.1, 1.0)
    fs = [problem.gradient @ (size * rng.normal(size=6 * N)) for size in sizes]
    used = solver_of(problem, name)
    forward = [used.solve(f).x for f in fs]
    for f, v in reversed(list(zip(fs, forward, strict=True))):
        np.testing.assert_array_equal(used.solve(f).x, v)
        np.testing.assert_array_equal(solver_of(problem, name).solve(f).x, v)


def test_what_osqp_takes_for_infeasible_by_rounding_is_left_to_daqp() -> None:
    """As in walking problems whose first row is 0 x <= h - h."""
    problem = problem_of(12)
    A = np.vstack([problem.A, np.zeros(len(problem.H))])
    upper, lower = np.append(problem.upper, -1e-17), np.append(problem.lower, -np.inf)
    f = problem.gradient @ (0.1 * np.random.default_rng(12).normal(size=6 * N))
    answer = solver_of(replace(problem, A=A, upper=upper, lower=lower), "osqp").solve(f)
    assert answer.status == SOLVED
    np.testing.assert_allclose(answer.x, solver_of(problem).solve(f).x, atol=1e-4)


@pytest.mark.parametrize("name", sorted(SOLVERS))
def test_no_solution_is_a_typed_result(name: str) -> None:
    """A least force that two feet cannot carry within the box, and a NaN in the measurements."""
    impossible = replace(PLANNER, force_min=50.0, deviation_max=(20.0, 20.0, 5.0))
    standing = build_problem(impossible, response(9), stance_of(0))
    answer = solver_of(standing, name).solve(np.zeros(len(standing.H)))
    assert answer.status == "infeasible"
    assert (answer.x == 0).all()
    assert answer.residuals.primal == np.inf
    problem = problem_of(9)
    broken = np.zeros(len(problem.H))
    broken[3] = np.nan
    solver = solver_of(problem, name)
    assert solver.solve(broken).status == "not-finite"
    assert solver.solve(np.zeros(len(problem.H))).status == SOLVED


def test_a_wrong_answer_is_not_taken_for_a_solution() -> None:
    """A solver that claims success is not believed: its answer is dropped, its residuals kept."""
    problem = problem_of(11)
    f = problem.gradient @ (0.2 * np.random.default_rng(11).normal(size=6 * N))
    good = solver_of(problem).solve(f)
    right = judge(problem, f, good.x, good.multipliers, SOLVED, 7)
    np.testing.assert_array_equal(right.x, good.x)
    nan = good.x * np.nan
    for v, multipliers in (
        (1.01 * good.x, good.multipliers),
        (good.x, 0 * good.multipliers),
        (nan, good.multipliers),
    ):
        wrong = judge(problem, f, v, multipliers, SOLVED, 7)
        assert wrong.status == "inaccurate"
        assert (wrong.x == 0).all()
        assert wrong.residuals != good.residuals
