"""Newton's method on the faces of feet's limits: against DAQP, and with multipliers as proof."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import daqp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.agents.planner import qp_solver
from quadriga.agents.planner.foot_limits import (
    FAILED,
    ForceQp,
    WithinLimits,
    has_foot_limits,
    minimise_freely,
    minimise_within,
)
from quadriga.agents.planner.optimality import residuals
from quadriga.agents.planner.planner_qp import PlannerProblem
from quadriga.agents.planner.qp_solver import SOLVED, SOLVERS
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import Array
from tests.a1 import build_problem

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


def qp_of(problem: PlannerProblem) -> ForceQp:
    inverse = np.asarray(np.linalg.inv(problem.H), dtype=np.float64)
    return ForceQp(problem.H, -inverse, problem.lower, problem.upper, problem.slope)


def minimise(problem: PlannerProblem, f: Array) -> WithinLimits:
    qp = qp_of(problem)
    return minimise_within(qp, f, minimise_freely(qp, f)[0])


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
def test_it_is_the_minimiser_of_a_dual_active_set(
    seed: int, box: tuple[float, float, float], force_min: float, mu: float, size: float
) -> None:
    """Forces that are asked for far beyond the limits put feet on sides, edges and corners."""
    problem = problem_of(seed, box, force_min, mu)
    asked = size * np.random.default_rng(seed).normal(size=len(problem.H))
    found = minimise(problem, -problem.H @ asked)
    assert found.solutions != FAILED
    np.testing.assert_allclose(found.v, by_daqp(problem, -problem.H @ asked), atol=1e-5)


@given(
    seed=st.integers(0, 2**32 - 1),
    box=st.sampled_from(BOXES),
    force_min=st.sampled_from([0.0, 5.0, 20.0]),
    size=st.sampled_from([1.0, 10.0, 100.0, 1e4]),
)
def test_its_multipliers_prove_it(
    seed: int, box: tuple[float, float, float], force_min: float, size: float
) -> None:
    """Every condition of optimality, computed from A: gradient, bounds, signs, complementarity."""
    problem = problem_of(seed, box, force_min)
    f = -problem.H @ (size * np.random.default_rng(seed).normal(size=len(problem.H)))
    found = minimise(problem, f)
    checked = residuals(problem, f, found.v, found.multipliers)
    assert max(checked.stationarity, checked.primal, checked.complementarity) < 1e-8
    told = (found.stationarity, found.primal, found.complementarity)
    np.testing.assert_allclose(
        told, (checked.stationarity, checked.primal, checked.complementarity), atol=1e-10
    )
    values = np.concatenate([found.v, problem.A @ found.v])
    scale = max(1.0, float(np.abs(f).max()))
    assert (found.multipliers[values < problem.upper - 1e-6] <= 1e-9 * scale).all()
    assert (found.multipliers[values > problem.lower + 1e-6] >= -1e-9 * scale).all()


def test_a_foot_is_held_where_its_pyramid_meets_the_box() -> None:
    """More sideways force needs more upward force up to there, and is of no use beyond."""
    problem = problem_of(0, box=(20.0, 20.0, 60.0), coupling=0.0)
    asked = np.zeros(len(problem.H))
    asked[0], asked[2] = 1000.0, -60.0  # far sideways, and not upwards at all
    found = minimise(problem, -problem.H @ asked)
    side = problem.upper[len(asked)]
    assert found.v[0] == pytest.approx(20.0)
    assert found.v[2] == pytest.approx((20.0 - side) / problem.slope)
    at_box, at_side = found.multipliers[0], found.multipliers[len(asked)]
    assert at_box > 0.0
    assert at_side > 0.0


def test_its_bits_depend_on_f_alone() -> None:
    problem = problem_of(3)
    asked = 100.0 * np.random.default_rng(3).normal(size=(4, len(problem.H)))
    fs = [-problem.H @ v for v in asked]
    first = [minimise(problem, f) for f in fs]
    for f, found in zip(reversed(fs), reversed(first), strict=True):
        again = minimise(problem, f)
        np.testing.assert_array_equal(again.v, found.v)
        np.testing.assert_array_equal(again.multipliers, found.multipliers)


def test_a_cycle_is_left_to_daqp(monkeypatch: pytest.MonkeyPatch) -> None:
    """Outputs that forces of all feet move as strongly as their own make it cycle."""
    problem = problem_of(1, coupling=10.0)
    f = problem.gradient @ np.random.default_rng(1).normal(size=6 * N)
    assert minimise(problem, f).solutions == FAILED
    calls: list[int] = []
    judge = qp_solver.judge

    def counted(*given: Any) -> qp_solver.QpSolution:
        calls.append(1)
        return judge(*given)

    solver = SOLVERS["daqp"](problem)
    monkeypatch.setattr(qp_solver, "judge", counted)
    solution = solver.solve(f)
    assert (solution.status, calls) == (SOLVED, [1])
    np.testing.assert_allclose(solution.x, by_daqp(problem, f), atol=1e-5)


def test_other_bounds_are_not_taken_for_limits_of_feet() -> None:
    problem = problem_of(4)
    lower, upper, nv = problem.lower, problem.upper, len(problem.H)
    assert has_foot_limits(lower, upper, problem.slope)
    none_left, lopsided, pulling = lower.copy(), lower.copy(), lower.copy()
    none_left[2] = upper[2] + 1.0
    lopsided[0] = lower[0] + 1.0
    pulling[2] = -upper[nv] / problem.slope - 1.0
    for other in (none_left, lopsided, pulling):
        assert not has_foot_limits(other, upper, problem.slope)
    assert not has_foot_limits(lower, upper, 0.0)
