"""Every fit of G against the true response of known systems, and against explicit references."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.agents.predictor.episode import Y_SCALE, Episode
from quadriga.agents.predictor.fits import FITS, fit, fit_ridge
from quadriga.agents.predictor.hankel import mosaic, split
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.agents.predictor.regression import (
    Penalty,
    agents_first,
    normal_equations,
    scaled_blocks,
    solve_ridge,
    to_physical,
)
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError
from quadriga.shared.robot.conventions import N_FORCES, N_OUTPUTS, Array

Team = Callable[..., Any]
T_INI, N = 3, 4


def meta_for(robots: int, **changes: Any) -> PredictorMeta:
    config = Config()
    config = replace(
        config,
        team=replace(config.team, robots=robots),
        planner=replace(config.planner, N=N, T_ini=T_INI),
    )
    return replace(PredictorMeta.of(config), **changes)


def random_walk(
    robots: int,
    samples: int,
    seed: int,
    B: Callable[[int, Array], Array] | None = None,
    noise: float = 0.0,
    data: int = 0,
) -> Episode:
    """A walk of a random stable system of four states per robot; u and y of the scales' sizes.

    Args:
        robots: in the team, all coupled.
        samples: of the walk.
        seed: of the system.
        B: input matrix at a sample, from the constant one.
        noise: on the outputs, relative to their scales.
        data: seed of inputs and noise.
    """
    rng, n_x = np.random.default_rng(seed), 4 * robots
    angles, radii = rng.uniform(0.2, 2.5, n_x // 2), rng.uniform(0.5, 0.9, n_x // 2)
    A = np.zeros((n_x, n_x))
    for k, (angle, radius) in enumerate(zip(angles, radii, strict=True)):
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        A[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = radius * turn
    Q = np.linalg.qr(rng.normal(size=(n_x, n_x)))[0]
    A = Q @ A @ Q.T
    B_0, C = rng.normal(size=(n_x, 12 * robots)) / 4, rng.normal(size=(6 * robots, n_x)) / 4
    rng = np.random.default_rng([seed, data])
    u, x = rng.normal(size=(samples, 12 * robots)), rng.normal(size=n_x)
    y = np.empty((samples, 6 * robots))
    for k in range(samples):
        x = A @ x + (B_0 if B is None else B(k, B_0)) @ u[k]
        y[k] = C @ x
    y += noise * rng.normal(size=y.shape)
    shape = (samples, robots)
    return Episode(
        10.0 * u.reshape(*shape, 12),
        np.zeros((*shape, 12)),
        y.reshape(*shape, 6) * Y_SCALE,
        np.zeros((*shape, 6)),
        first_tick=410,
    )


def relative_error(predictor: Predictor, episode: Episode) -> float:
    """Largest error of all windows over the largest output, in scaled units."""
    z, y = episode.windows(T_INI, N)
    n, _, windows = y.shape
    error, size = (
        (array.reshape(n, N, 6, windows) / Y_SCALE[:, None])
        for array in (predictor.predict(z) - y, y)
    )
    return float(np.abs(error).max() / np.abs(size).max())


def assert_same(first: Predictor, second: Predictor, atol: float) -> None:
    """Equal blocks in scaled units."""
    ours, theirs = (scaled_blocks(p.G, p.meta.layout) for p in (first, second))
    np.testing.assert_allclose(ours, theirs, atol=atol)


@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 2**31), robots=st.integers(1, 3))
def test_every_fit_reproduces_the_true_response(seed: int, robots: int) -> None:
    data = [random_walk(robots, 120 + 130 * robots, seed, data=k) for k in (1, 2)]
    # The fundamental lemma holds of these data: rank = m (T_ini + N) + order.
    H = mosaic([np.concatenate(episode.scaled_deviations(), axis=1) for episode in data], T_INI + N)
    assert np.linalg.matrix_rank(H) == 12 * robots * (T_INI + N) + 4 * robots
    unseen = random_walk(robots, 60, seed, data=3)
    for kind in [kind for kind in FITS if kind != "periodic"]:  # which shrinks: a test of its own
        meta = meta_for(robots, kind=kind, ridge=1e-12, block_weight=1.0)
        predictor = fit(data, meta)
        assert predictor.meta.kind == kind
        assert relative_error(predictor, unseen) < 1e-8, kind


def fit_hankel(episodes: Sequence[Episode], meta: PredictorMeta) -> Predictor:
    """G = Y_f [U_p; Y_p; U_f]† (eq. 6) as the paper has it; forms the Hankel matrices.

    The independent reference of the other fits; takes minutes where they take seconds.
    """
    u, y = zip(*(episode.scaled_deviations() for episode in episodes), strict=True)
    parts = split(u, y, meta.T_ini, meta.N)
    Z = np.concatenate([parts.U_p, parts.Y_p, parts.U_f])
    G = parts.Y_f @ np.linalg.pinv(Z)
    n, m, p = meta.robots, N_FORCES, N_OUTPUTS
    past_u, past_y, future_u = np.split(
        np.arange(len(Z)), [n * m * meta.T_ini, n * (m + p) * meta.T_ini]
    )
    columns_of = np.concatenate(
        [agents_first(x, n, d) for x, d in ((past_u, m), (past_y, p), (future_u, m))], axis=1
    ).ravel()
    rows_of = agents_first(np.arange(len(G)), n, p)
    x = G[rows_of[:, None, :], columns_of[:, None]]
    plain = replace(meta, kind="pinv", phases=1, ridge=0.0, block_weight=1.0)
    return Predictor(plain, to_physical(x, meta.layout)[None], float(np.linalg.cond(Z)) ** 2)


@pytest.mark.parametrize("robots", [1, 2, 3])
def test_the_pseudo_inverse_is_that_of_the_explicit_hankel_matrix(robots: int) -> None:
    data = [random_walk(robots, 300, 5, noise=0.3, data=k) for k in (1, 2)]
    reference = fit_hankel(data, meta_for(robots))
    found = fit(data, meta_for(robots, kind="pinv"))
    assert_same(found, reference, 1e-9)
    assert found.condition == pytest.approx(reference.condition, rel=30)


def test_of_many_solutions_the_pseudo_inverse_takes_the_least() -> None:
    data = [random_walk(1, 300, 6)]
    found, reference = fit(data, meta_for(1, kind="pinv")), fit_hankel(data, meta_for(1))
    assert_same(found, reference, 1e-7)


@pytest.mark.parametrize(("robots", "weight"), [(1, 160.0), (2, 1.0), (3, 160.0), (5, 1e4)])
def test_shared_eliminations_solve_what_each_robot_would_alone(robots: int, weight: float) -> None:
    meta = meta_for(robots, block_weight=weight)
    data = [random_walk(robots, 400, 7, noise=0.3)]
    signals = [np.concatenate(episode.scaled_deviations(), axis=1) for episode in data]
    regression, W = normal_equations(signals, meta.layout), meta.width
    x = solve_ridge(regression, meta.layout, Penalty(1e-3, weight)).x
    for i in range(robots):
        penalty = 1e-3 * regression.windows * np.where(np.arange(robots) == i, 1.0, weight**2)
        direct = np.linalg.solve(
            regression.zz + np.diag(np.repeat(penalty, W)), regression.zy[:, i]
        )
        np.testing.assert_allclose(x[i], direct, atol=1e-10)


@pytest.mark.parametrize("kind", FITS)
def test_robots_that_are_not_yoked_are_uncoupled_if_asked(kind: str) -> None:
    data = [random_walk(3, 500, 13, noise=0.1)]
    whole = meta_for(3, kind=kind, block_weight=2.0)
    yoked = fit(data, replace(whole, yokes="chain", neighbours="yoked"))
    for i in range(3):
        for j in range(3):
            assert yoked.block(i, j).any() == (abs(i - j) <= 1)
    for yokes, neighbours in (("complete", "yoked"), ("chain", "all"), ("ring", "yoked")):
        same = fit(data, replace(whole, yokes=yokes, neighbours=neighbours))
        np.testing.assert_array_equal(same.G, fit(data, whole).G)


def test_a_robot_without_strangers_is_fitted_as_if_alone_with_its_neighbours() -> None:
    """Robot 1 of a chain of two pairs, against the fit of the first three robots."""
    data = random_walk(4, 700, 14, noise=0.1)
    chain = fit_ridge([data], meta_for(4, yokes="chain", neighbours="yoked"))
    cut = replace(
        data,
        u=data.u[:, :3],
        u_nominal=data.u_nominal[:, :3],
        y=data.y[:, :3],
        y_base=data.y_base[:, :3],
    )
    three = fit_ridge([cut], meta_for(3))
    for j in range(3):
        np.testing.assert_allclose(chain.block(1, j), three.block(1, j), atol=1e-10)


def test_forces_that_do_not_excite_are_refused_without_a_penalty() -> None:
    data = random_walk(1, 400, 15, noise=0.1)
    dead = data.u.copy()
    dead[:, 0, 5] = 0.0
    with pytest.raises(PredictorError, match=r"a larger ridge \(identification\.ridge\)"):
        fit_ridge([replace(data, u=dead)], meta_for(1, ridge=0.0))


@pytest.mark.parametrize("kind", FITS)
def test_data_that_no_fit_can_use_are_refused_by_name(kind: str) -> None:
    meta = meta_for(2, kind=kind)
    good = random_walk(2, 100, 16)
    with pytest.raises(PredictorError, match="at least one"):
        fit([], meta)
    with pytest.raises(PredictorError, match=r"got 2 robots, expected 3 \(data of another team\)"):
        fit([good], replace(meta, robots=3))
    short = Episode(good.u[:6], good.u_nominal[:6], good.y[:6], good.y_base[:6], 410)
    with pytest.raises(PredictorError, match="got 6 samples, expected at least 7"):
        fit([good, short], meta)
    with pytest.raises(PredictorError, match=r"episode\.u: got NaN"):
        replace(good, u=good.u * np.nan)


def test_blocks_scale_back_and_forth() -> None:
    meta = meta_for(2)
    x = np.random.default_rng(0).normal(size=(2, 2 * meta.width, 6 * N))
    back = scaled_blocks(to_physical(x, meta.layout), meta.layout)
    np.testing.assert_allclose(
        back, x.reshape(2, 2, meta.width, 6 * N).transpose(0, 1, 3, 2), rtol=1e-14
    )
