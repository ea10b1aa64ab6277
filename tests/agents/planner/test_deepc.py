"""DeePC without g and σ: against eq. 5 with them, and against a plant whose response is known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import daqp
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from quadriga.agents.gait import horizon_stance
from quadriga.agents.planner.qp import Condensed, PlannerProblem, constrain
from quadriga.agents.planner.team import build_model, select
from quadriga.agents.predictor.episode import U_SCALE, Y_SCALE, Episode, team_layout
from quadriga.agents.predictor.hankel import hankel
from quadriga.agents.predictor.regression import Reduction, reduce
from quadriga.shared.config.sections import Config, PlannerConfig
from quadriga.shared.robots.conventions import Array
from tests.a1 import WEIGHT

Team = Callable[..., Any]
T_INI, N = 2, 3
PLANNER = replace(Config().planner, T_ini=T_INI, N=N)
CONFIG = replace(Config(), planner=PLANNER)


@dataclass(frozen=True)
class Case:
    """Data of a team, their reduction, and one tick."""

    episodes: tuple[Episode, ...]
    reduction: Reduction
    past: Array
    y_des: Array
    stance: NDArray[np.bool_]  # (n, N, 4)

    @property
    def columns(self) -> NDArray[np.int64]:
        return np.flatnonzero(np.repeat(self.stance, 3, axis=2))


def case_of(team: Team, n: int, seed: int, noise: float, step: int = 20) -> Case:
    """Two walks of different lengths, then a tick that is not one of theirs."""
    plant, rng = team(n), np.random.default_rng(seed)
    episodes = tuple(
        plant.episode(samples, seed + k, noise=noise) for k, samples in enumerate((70 * n, 55 * n))
    )
    past = [
        np.concatenate(
            [
                (12.0 * rng.normal(size=(T_INI, 12))).ravel(),
                (rng.normal(size=(T_INI, 6)) * Y_SCALE).ravel(),
            ]
        )
        for _ in range(n)
    ]
    return Case(
        episodes,
        reduce(episodes, team_layout(n, T_INI, N)),
        np.concatenate(past),
        (rng.normal(size=(n * N, 6)) * Y_SCALE).ravel(),
        np.stack([horizon_stance(CONFIG, i, step) for i in range(n)]),
    )


def reduced(case: Case, planner: PlannerConfig, lambda_g: float, lambda_sigma: float) -> Condensed:
    weights = replace(planner, lambda_g=lambda_g, lambda_sigma=lambda_sigma)
    return select(build_model(case.reduction, weights), case.columns)


def outputs(problem: Condensed, case: Case, v: Array) -> Array:
    y: Array = problem.free(case.past, case.y_des) + problem.Y_v @ v
    return y


def written_out(
    case: Case, lambda_g: float, lambda_sigma: float
) -> tuple[Array, Array, Array, Array]:
    """Eq. 5 in u, y, g, σ: Hessian P, linear term q, and E x = e with swing forces at zero."""
    n = len(case.stance)
    U, Y = (
        np.hstack([hankel(w, T_INI + N) for w in signals])
        for signals in zip(
            *(each.scaled_deviations(team_layout(n, T_INI, N)) for each in case.episodes),
            strict=True,
        )
    )
    (U_p, U_f), (Y_p, Y_f) = (
        (by_robot(X[: T_INI * n * d], n, d), by_robot(X[T_INI * n * d :], n, d))
        for X, d in ((U, 12), (Y, 6))
    )
    past = case.past.reshape(n, -1)
    u_ini = past[:, : 12 * T_INI].ravel() / U_SCALE
    y_ini = (past[:, 12 * T_INI :].reshape(-1, 6) / Y_SCALE).ravel()
    m, p, M, s = len(U_f), len(Y_f), U_f.shape[1], len(Y_p)
    P = np.diag(
        np.concatenate(
            [
                np.tile(PLANNER.R, m // 3),
                np.tile(PLANNER.Q, p // 6),
                np.full(M, lambda_g),
                np.full(s, lambda_sigma),
            ]
        )
    )
    q = np.concatenate([np.zeros(m), -np.tile(PLANNER.Q, p // 6) * case.y_des, np.zeros(M + s)])
    swing = np.setdiff1d(np.arange(m), case.columns)

    def row(u: Array, y: Array, g: Array, sigma: Array) -> Array:
        return np.hstack([u, y, g, sigma])

    def no(rows: int, count: int) -> Array:
        return np.zeros((rows, count))

    E = np.vstack(
        [
            row(no(len(U_p), m), no(len(U_p), p), U_p, no(len(U_p), s)),
            row(no(s, m), no(s, p), Y_p, np.eye(s)),
            row(-np.eye(m) / U_SCALE, no(m, p), U_f, no(m, s)),
            row(no(p, m), -np.diag(1.0 / np.tile(Y_SCALE, p // 6)), Y_f, no(p, s)),
            row(np.eye(m)[swing], no(len(swing), p), no(len(swing), M), no(len(swing), s)),
        ]
    )
    e = np.concatenate([u_ini, y_ini, np.zeros(m + p + len(swing))])
    return P, q, E, e


def by_robot(rows: Array, n: int, dim: int) -> Array:
    """Rows (time, robot, component) sorted by robot, then time."""
    time, robot, part = np.unravel_index(np.arange(len(rows)), (len(rows) // (n * dim), n, dim))
    return rows[np.lexsort((part, time, robot))]


@settings(max_examples=25, deadline=None)
@given(
    n=st.sampled_from([1, 1, 2]),
    seed=st.integers(0, 10_000),
    noise=st.sampled_from([0.0, 0.05, 0.3]),
    step=st.integers(0, 30),
    lambda_g=st.floats(0.1, 1e4),
    lambda_sigma=st.floats(1.0, 1e6),
)
def test_without_active_bounds_it_is_the_saddle_point_of_equation_5(
    linear_team: Team,
    n: int,
    seed: int,
    noise: float,
    step: int,
    lambda_g: float,
    lambda_sigma: float,
) -> None:
    case = case_of(linear_team, n, seed, noise, step)
    problem = reduced(case, PLANNER, lambda_g, lambda_sigma)
    f = problem.F_past @ case.past + problem.F_des @ case.y_des
    v = np.asarray(-np.linalg.solve(problem.H, f), np.float64)
    P, q, E, e = written_out(case, lambda_g, lambda_sigma)
    K = np.block([[P, E.T], [E, np.zeros((len(E), len(E)))]])
    u, y = np.split(np.linalg.solve(K, np.concatenate([-q, e])), [12 * n * N, 18 * n * N])[:2]
    np.testing.assert_allclose(u[case.columns], v, atol=1e-6 * (1.0 + np.abs(v).max()))
    error = (outputs(problem, case, v) - y).reshape(-1, 6) / Y_SCALE
    np.testing.assert_allclose(error, 0.0, atol=1e-6)


def bounded(
    case: Case, lambda_g: float, tightness: float
) -> tuple[Condensed, PlannerProblem, PlannerConfig, Array]:
    """A problem whose bounds matter: cost, limits, configuration, and the exact answer."""
    condensed = reduced(case, PLANNER, lambda_g, 1e3)
    f = condensed.F_past @ case.past + condensed.F_des @ case.y_des
    free = np.abs(np.linalg.solve(condensed.H, f)).reshape(-1, 3)
    planner = replace(PLANNER, mu=0.3, deviation_max=tuple(tightness * free.max(axis=0)))
    problem = constrain(planner, WEIGHT, condensed, case.stance.reshape(-1, 4))
    v, active = exact(condensed.H, f, problem.A, problem.lower, problem.upper)
    assert active
    return condensed, problem, planner, v


def exact(H: Array, f: Array, A: Array, lower: Array, upper: Array) -> tuple[Array, int]:
    """The minimiser by a dense active-set method, and how many bounds are active."""
    x, _, flag, info = daqp.solve(
        H,
        f,
        np.ascontiguousarray(A),
        np.minimum(upper, 1e30),
        np.maximum(lower, -1e30),
        np.where(lower == upper, 5, 0).astype(np.int32),
        primal_tol=1e-9,
    )
    assert flag == 1
    return x, int((np.abs(info["lam"]) > 0).sum())


@settings(max_examples=15, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    noise=st.sampled_from([0.0, 0.05, 0.3]),
    step=st.integers(0, 30),
    lambda_g=st.floats(0.3, 1e4),
    tightness=st.floats(0.2, 0.6),
)
def test_with_active_bounds_it_is_equation_5(
    linear_team: Team, seed: int, noise: float, step: int, lambda_g: float, tightness: float
) -> None:
    """With all of u, y, g, σ as unknowns, solved by the same exact method."""
    case = case_of(linear_team, 1, seed, noise, step)
    condensed, problem, _, v = bounded(case, lambda_g, tightness)
    P, q, E, e = written_out(case, lambda_g, 1e3)
    rows, nv = np.zeros((len(problem.upper), len(q))), len(v)
    rows[:, case.columns] = np.vstack([np.eye(nv), problem.A])
    free = np.full(len(q), np.inf)
    x, _ = exact(
        P,
        q,
        np.vstack([rows, E]),
        np.concatenate([-free, problem.lower, e]),
        np.concatenate([free, problem.upper, e]),
    )
    np.testing.assert_allclose(x[case.columns], v, atol=1e-6 * (1.0 + np.abs(v).max()))
    error = (outputs(condensed, case, v) - x[12 * N : 18 * N]).reshape(-1, 6) / Y_SCALE
    np.testing.assert_allclose(error, 0.0, atol=1e-6)


def test_without_noise_it_predicts_the_true_response(linear_team: Team) -> None:
    """λ_g small and λ_σ large: the past alone decides z, whatever is desired."""
    n, plant, rng = 2, linear_team(2), np.random.default_rng(0)
    case = case_of(linear_team, n, 7, 0.0)
    du = 12.0 * rng.normal(size=(60, n, 12))
    y = plant.respond(du)
    start = 60 - T_INI - N
    past = [
        np.concatenate([x[start : start + T_INI, i].ravel() for x in (du, y)]) for i in range(n)
    ]
    model = build_model(case.reduction, replace(PLANNER, lambda_g=1e-7, lambda_sigma=1e12))
    u = du[start + T_INI :].transpose(1, 0, 2).ravel()
    predicted = model.free(np.concatenate(past), case.y_des) + model.Y_v @ u
    true = y[start + T_INI :].transpose(1, 0, 2)
    np.testing.assert_allclose((predicted.reshape(n, N, 6) - true) / Y_SCALE, 0.0, atol=1e-6)
