"""Every fit of G against the true response of known systems, and against explicit references."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from quadriga.agents.predictor.episode import Y_SCALE, Episode
from quadriga.agents.predictor.fits import FITS, fit, fit_ridge
from quadriga.agents.predictor.predictor import PredictorMeta
from quadriga.agents.predictor.regression import (
    Penalty,
    normal_equations,
    scaled_blocks,
    solve_ridge,
    to_physical,
)
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError
from quadriga.shared.robots.conventions import Array

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
