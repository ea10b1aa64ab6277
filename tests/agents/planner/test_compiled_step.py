"""The compiled planning step against the way through the solver."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.agents.gait import nominal_table
from quadriga.agents.planner.compiled_step import CompiledStep, OwnWindow
from quadriga.agents.planner.planner import PlannerInputs
from quadriga.agents.planner.planner_qp import unpack
from quadriga.agents.planner.qp_solver import SOLVED, SOLVERS
from quadriga.shared.config.sections import PlannerConfig
from quadriga.shared.robots.conventions import Array
from tests.a1 import WEIGHT, build_problem, nominal_forces

T_INI, N = 3, 5
CONFIG = replace(PlannerConfig(), T_ini=T_INI, N=N)
RNG = np.random.default_rng(7)
G = 0.01 * RNG.normal(size=(6 * N, 18 * T_INI + 12 * N))
STANCE = np.tile([True, False, False, True], (N, 1))
STANCE[3:] = ~STANCE[3:]
NOMINAL = nominal_forces(STANCE)
PROBLEM = build_problem(CONFIG, G[:, 18 * T_INI :], STANCE, G[:, : 18 * T_INI])
SOLVER = SOLVERS["daqp"](PROBLEM)
NONE = np.zeros(len(PROBLEM.columns))


@pytest.fixture(scope="module")
def step() -> CompiledStep:
    assert SOLVER.compiled is not None
    return CompiledStep(PROBLEM, SOLVER.compiled, NOMINAL, nominal_table(WEIGHT))


def inputs_of(seed: int, size: float) -> PlannerInputs:
    rng = np.random.default_rng(seed)
    stance_ini = rng.random((T_INI, 4)) < 0.5
    return PlannerInputs(
        step=3,
        u_ini=nominal_forces(stance_ini) + size * rng.normal(size=(T_INI, 12)),
        y_ini=1e-2 * size * rng.normal(size=(T_INI, 6)),
        stance_ini=stance_ini,
        y_base_ini=1e-2 * size * rng.normal(size=(T_INI, 6)),
        y_base=rng.normal(size=(N, 6)),
        y_des=rng.normal(size=(1, 6)) + 1e-3 * size * rng.normal(size=(N, 6)),
        weight=WEIGHT,
    )


def still(y_base: Array, y_des: Array) -> OwnWindow:
    """A window without any deviation."""
    zero, stance = np.zeros((T_INI, 6)), STANCE[:T_INI]
    return OwnWindow(nominal_forces(stance), zero, stance, zero, y_base, y_des)


@given(seed=st.integers(0, 2**32 - 1), size=st.floats(0.0, 2.0))
def test_both_ways_lead_to_the_same_plan(step: CompiledStep, seed: int, size: float) -> None:
    inputs = inputs_of(seed, size)
    inputs = replace(inputs, y_des=inputs.y_base + 1e-3 * size * (inputs.y_des - inputs.y_base))
    effect = 1e-3 * size * np.random.default_rng(seed + 1).normal(size=6 * N)
    y_free = PROBLEM.condensed.Y_past @ inputs.past() + effect
    f = PROBLEM.gradient @ (y_free - (inputs.y_des - inputs.y_base).ravel())
    solution = SOLVER.solve(f)
    plan = step.plan(inputs.window(), effect, NONE)
    assert solution.status == SOLVED
    assert plan is not None
    assert plan.iterations == solution.iterations
    assert plan.residuals == solution.residuals
    du, dy = unpack(PROBLEM, solution.x, y_free)
    expected = NOMINAL + du, du, inputs.y_base + dy, inputs.y_base + y_free.reshape(N, 6)
    for found, wanted in zip(plan[:4], expected, strict=True):
        np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9)
    assert (plan[0].reshape(N, 4, 3)[~STANCE] == 0.0).all()


def test_small_errors_meet_no_limit_and_large_ones_do(step: CompiledStep) -> None:
    """The comparison above sees both sides."""
    zero = np.zeros((N, 6))
    for size, limited in ((1e-6, False), (0.16, True)):
        plan = step.plan(still(zero, np.full((N, 6), size)), np.zeros(6 * N), NONE)
        assert plan is not None
        assert (plan.iterations > 0) is limited


def test_a_share_of_the_last_plan_is_kept(step: CompiledStep) -> None:
    assert SOLVER.compiled is not None
    keeping = CompiledStep(PROBLEM, SOLVER.compiled, NOMINAL, nominal_table(WEIGHT), kept=0.25)
    own, effect = still(np.zeros((N, 6)), np.full((N, 6), 0.16)), np.zeros(6 * N)
    last = RNG.normal(size=len(NONE))
    best, mixed = step.plan(own, effect, last), keeping.plan(own, effect, last)
    assert best is not None
    assert mixed is not None
    du = np.zeros(12 * N)
    du[PROBLEM.columns] = 0.75 * best.du.ravel()[PROBLEM.columns] + 0.25 * last
    np.testing.assert_array_equal(mixed.du.ravel(), du)
    y = mixed.y_nominal.ravel() + PROBLEM.condensed.Y_v @ du[PROBLEM.columns]
    np.testing.assert_allclose(mixed.y.ravel(), y, atol=1e-12)


def test_a_cycle_is_left_to_the_solver(step: CompiledStep) -> None:
    zero = np.zeros((N, 6))
    y_des = np.full((N, 6), 0.5)
    assert step.plan(still(zero, y_des), np.zeros(6 * N), NONE) is None
    assert SOLVER.solve(PROBLEM.gradient @ -y_des.ravel()).status == SOLVED


def test_a_number_that_is_not_finite_is_left_to_the_solver(step: CompiledStep) -> None:
    inputs = inputs_of(1, 0.01)
    for bad in (np.nan, np.inf):
        effect = np.full(6 * N, bad)
        assert step.plan(inputs.window(), effect, NONE) is None


def test_outputs_that_no_robot_reaches_are_no_plan(step: CompiledStep) -> None:
    """Even where no force is asked for: the error is zero."""
    zero = np.zeros((N, 6))
    for height, is_plan in ((99.0, True), (101.0, False), (np.nan, False)):
        plan = step.plan(still(zero + height, zero + height), np.zeros(6 * N), NONE)
        assert (plan is not None) == is_plan
