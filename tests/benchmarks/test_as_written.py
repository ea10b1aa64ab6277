"""The paper's problems in OSQP: tightly solved they are the condensed ones, solved exactly."""

from __future__ import annotations

from dataclasses import replace

import daqp
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from benchmarks.as_written import TIGHT, PaperQp
from quadriga.agents.gait import horizon_stance
from quadriga.shared.config.sections import Config, PlannerConfig
from quadriga.shared.robots.conventions import Array
from tests.a1 import build_problem, nominal_forces

N = 5
PLANNER = replace(Config().planner, N=N, force_min=2.0)
CONFIG = replace(Config(), planner=PLANNER)


def response(n: int, seed: int) -> Array:
    """A causal response of n robots' outputs to their forces. Shape (6 n N, 12 n N)."""
    G = np.random.default_rng(seed).normal(size=(n, N, 6, n, N, 12)) * 1e-4
    G *= np.array([1.0, 30.0, 30.0, 10.0, 10.0, 30.0])[:, None, None, None]
    G *= np.where(np.eye(n), 1.0, 0.3)[:, None, None, :, None, None]
    causal = np.arange(N)[:, None] >= np.arange(N)[None, :]
    return (G * causal[None, :, None, None, :, None]).reshape(6 * n * N, 12 * n * N)


def stance_of(n: int, step: int) -> NDArray[np.bool_]:
    return np.stack([horizon_stance(CONFIG, i, step) for i in range(n)])


def exact(
    config: PlannerConfig, G_u: Array, stance: NDArray[np.bool_], y_free: Array, y_des: Array
) -> tuple[Array, Array, int]:
    """Forces (n, N, 12) and outputs (n, N, 6) by DAQP on the condensed problem; active bounds."""
    problem = build_problem(config, G_u, stance.reshape(-1, 4))
    f = problem.gradient @ (y_free - y_des)
    v, _, flag, info = daqp.solve(
        problem.H,
        f,
        problem.A,
        problem.upper,
        np.maximum(problem.lower, -1e30),
        np.zeros(len(problem.upper), dtype=np.int32),
        primal_tol=1e-9,
    )
    assert flag == 1
    u = np.zeros(G_u.shape[1])
    u[problem.columns] = v
    shape = stance.shape[:2]
    active = int((np.abs(info["lam"]) > 1e-6).sum())
    return u.reshape(*shape, 12), (y_free + G_u @ u).reshape(*shape, 6), active


@settings(max_examples=20, deadline=None)
@given(
    n=st.sampled_from([1, 2]),
    seed=st.integers(0, 10_000),
    step=st.integers(0, 30),
    size=st.sampled_from([1e-3, 0.02, 0.1]),
    mu=st.floats(0.2, 1.0),
)
def test_tightly_solved_it_is_the_condensed_problem(
    n: int, seed: int, step: int, size: float, mu: float
) -> None:
    """Eq. 12 (n = 1) and eq. 7 (n = 2), on the samples that are applied.

    OSQP's 1e-9 is relative to Q y_des, up to 1e5 here: over the least R that is 2e-3 N, and as
    much as forces of that size move the outputs.
    """
    planner, stance, rng = replace(PLANNER, mu=mu), stance_of(n, step), np.random.default_rng(seed)
    G_u, (y_free, y_des) = response(n, seed), size * rng.normal(size=(2, 6 * n * N))
    u, y, _ = exact(planner, G_u, stance, y_free, y_des)
    written = PaperQp(planner, G_u, TIGHT).solve(y_free, y_des, stance, nominal_forces(stance))
    assert written.status == "solved"
    np.testing.assert_allclose(written.u[:, : planner.applied], u[:, : planner.applied], atol=2e-3)
    moved = 2e-3 * np.linalg.norm(G_u, axis=1).max()
    np.testing.assert_allclose(written.y, y, atol=moved)
    np.testing.assert_allclose(written.u[~np.repeat(stance, 3, axis=2)], 0.0, atol=1e-9)


def test_one_object_serves_every_tick() -> None:
    """Gradient, free response and stance all change from tick to tick, bounds in and out."""
    rng, G_u = np.random.default_rng(0), response(1, 0)
    warm = PaperQp(PLANNER, G_u, TIGHT)
    counts = []
    for step, size in ((0, 1e-3), (20, 0.1), (21, 0.001), (22, 0.1), (25, 0.02), (20, 0.1)):
        stance = stance_of(1, step)
        y_free, y_des = size * rng.normal(size=(2, 6 * N))
        u, _, active = exact(PLANNER, G_u, stance, y_free, y_des)
        written = warm.solve(y_free, y_des, stance, nominal_forces(stance))
        assert written.status == "solved"
        np.testing.assert_allclose(written.u, u, atol=2e-3)
        counts.append(active)
    assert min(counts) == 0
    assert max(counts) > 5
