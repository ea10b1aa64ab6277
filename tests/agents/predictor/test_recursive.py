"""The recursive correction: equal to batch least squares, quick to follow, and never unbounded."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from quadriga.agents.predictor.fits import fit_ridge
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.agents.predictor.recursive import (
    Correction,
    Forgetting,
    begin_correction,
    block_correction,
    take_in,
    update,
)
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError
from quadriga.shared.robot.conventions import Array

Team = Callable[..., Any]


@pytest.fixture(scope="module")
def predictor(small: Config, linear_team: Team) -> Predictor:
    meta = replace(PredictorMeta.of(small), ridge=1e-9, block_weight=1.0)
    return fit_ridge([linear_team(2).episode(1500, 1)], meta)


def random_windows(k: int, outputs: int, count: int, seed: int) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    z = rng.normal(size=(count, k))
    return z, z @ rng.normal(size=(k, outputs)) + 0.1 * rng.normal(size=(count, outputs))


def state_of(k: int, outputs: int, how: Forgetting) -> Correction:
    return Correction(0, np.zeros((outputs, k)), how.prior * np.eye(k))


def test_without_forgetting_it_is_batch_least_squares() -> None:
    how = Forgetting(factor=1.0, prior=2.0, bound=2.0)
    z, y = random_windows(5, 3, 60, 0)
    state = state_of(5, 3, how)
    for row, target in zip(z, y, strict=True):
        state = update(state, row, target, how)
    assert (state.updates, state.skipped) == (60, 0)
    R = z.T @ z + np.eye(5) / 2.0
    np.testing.assert_allclose(state.D, np.linalg.solve(R, z.T @ y).T, atol=1e-10)
    np.testing.assert_allclose(state.P, np.linalg.inv(R), atol=1e-10)


def test_in_one_direction_it_is_exponentially_weighted_least_squares() -> None:
    how = Forgetting(factor=0.97, prior=2.0, bound=1e9)
    z, y = random_windows(1, 3, 60, 0)
    state = state_of(1, 3, how)
    for row, target in zip(z, y, strict=True):
        state = update(state, row, target, how)
    weight = 0.97 ** np.arange(59, -1, -1.0)
    R = (z.T * weight) @ z + 0.97**59 / 2.0
    np.testing.assert_allclose(state.D, ((z.T * weight) @ y / R).T, atol=1e-10)
    np.testing.assert_allclose(state.P, 1.0 / (0.97 * R), atol=1e-10)


def test_what_is_not_excited_is_not_forgotten() -> None:
    how = Forgetting(factor=0.9, prior=1.0, bound=1e9)
    state = state_of(2, 1, how)
    for _ in range(50):
        state = update(state, np.array([0.0, 1.0]), np.array([3.0]), how)
    known = state.D[0, 1], state.P[1, 1]
    for k in range(50):
        state = update(state, np.array([1.0, 0.0]), np.array([float(k)]), how)
    assert (state.D[0, 1], state.P[1, 1]) == known
    assert state.D[0, 0] > 39.0  # the older ones have been forgotten here


def heavier(team: Any, seed: int, samples: int, share: float) -> Any:
    """A walk of the same team whose forces move it only `share` as much."""
    episode = team.episode(samples, seed)
    du, _ = episode.deviations()
    return replace(episode, y=episode.y_base + team.respond(share * du))


def corrected(predictor: Predictor, state: Correction) -> Predictor:
    """The predictor with the correction in its blocks."""
    G = predictor.G.copy()
    G[:, state.robot, state.robot] += block_correction(predictor.meta.layout, state)
    return Predictor(predictor.meta, G, predictor.condition)


def mean_error(predictor: Predictor, episode: Any, robot: int) -> float:
    z, y = episode.windows(predictor.meta.T_ini, predictor.meta.N)
    error = (predictor.predict(z) - y)[robot].reshape(-1, 6, z.shape[2])
    return float(
        np.sqrt(np.mean((error / np.array([5e-3, 0.1, 0.1, 0.02, 0.02, 0.2])[:, None]) ** 2))
    )


def test_a_heavier_robot_is_followed(predictor: Predictor, linear_team: Team) -> None:
    team, how = linear_team(2), Forgetting(factor=0.9995, prior=1e-2, bound=0.1)
    z, y = heavier(team, 21, 1200, 0.6).windows(predictor.meta.T_ini, predictor.meta.N)
    state = begin_correction(predictor.meta.layout, 0, how)
    for k in range(z.shape[2]):
        state = take_in(state, predictor, z[:, :, k], y[0, :, k], 0, how)
    unseen = heavier(team, 22, 200, 0.6)
    found = corrected(predictor, state)
    before, after = (mean_error(p, unseen, 0) for p in (predictor, found))
    assert after < 0.1 * before
    for i, j in ((0, 1), (1, 0), (1, 1)):
        np.testing.assert_array_equal(found.block(i, j), predictor.block(i, j))


def test_a_plant_that_did_not_change_is_left_alone(predictor: Predictor, linear_team: Team) -> None:
    how = Forgetting()
    z, y = linear_team(2).episode(600, 23).windows(predictor.meta.T_ini, predictor.meta.N)
    state = begin_correction(predictor.meta.layout, 1, how)
    for k in range(z.shape[2]):
        state = take_in(state, predictor, z[:, :, k], y[1, :, k], 0, how)
    assert np.abs(state.D).max() < 1e-6


def test_under_constant_input_nothing_moves_and_nothing_grows() -> None:
    """Plain forgetting would let P grow as 0.99^−10000 in the directions that are never seen."""
    how = Forgetting(factor=0.99, prior=1.0, bound=10.0)
    z, y = random_windows(6, 4, 200, 1)
    state = state_of(6, 4, how)
    for row, target in zip(z, y, strict=True):
        state = update(state, row, target, how)
    rich = state
    constant, target = np.array([1.0, 0.5, 0.0, 0.0, 0.0, -1.0]), y[0]
    for k in range(10_000):
        state = update(state, constant, target, how)
        if k == 3000:
            settled = state
    np.testing.assert_allclose(state.D, settled.D, atol=1e-9)
    np.testing.assert_allclose(state.D @ constant, target, atol=1e-9)
    np.testing.assert_allclose(state.P, settled.P, atol=1e-9)
    across = np.linalg.qr(np.c_[rich.P @ constant, np.eye(6)])[0][:, 1:]
    np.testing.assert_allclose((state.D - rich.D) @ across, 0.0, atol=1e-9)  # along P z alone
    assert state.P.trace() < 1.0


def test_the_covariance_stays_bounded_symmetric_and_positive_whatever_is_excited() -> None:
    """Two of six directions excited, of a size that varies 10⁴-fold, 10,000 windows long."""
    how = Forgetting(factor=0.98, prior=1.0, bound=5.0)
    rng = np.random.default_rng(2)
    state = state_of(6, 2, how)
    for k in range(10_000):
        row = np.r_[rng.normal(size=2), np.zeros(4)] * 10.0 ** (-4 * (k % 1000 > 500))
        state = update(state, row, 2.0 * row[:2] * (1 + k / 5000), how)
        if k % 100 == 0:
            assert state.P.trace() <= 5.0 * 6 * (1 + 1e-12)
            assert np.linalg.eigvalsh(state.P)[0] > 0.0
    np.testing.assert_array_equal(state.P, state.P.T)
    np.testing.assert_allclose(state.D[:, :2], 6.0 * np.eye(2), atol=0.3)
    assert not state.D[:, 2:].any()
    silent = update(state, np.zeros(6), np.ones(2), how)
    assert silent.skipped == state.skipped + 1
    np.testing.assert_array_equal(silent.P, state.P)


@pytest.mark.parametrize("absurd", [1e4, 1e160, np.inf, np.nan])
def test_a_window_that_would_spoil_the_correction_is_refused_and_counted(absurd: float) -> None:
    how = Forgetting(prior=1.0, bound=2.0)
    z, y = random_windows(5, 3, 20, 0)
    state = state_of(5, 3, how)
    for row, target in zip(z, y, strict=True):
        state = update(state, row, target, how)
    spoilt = update(state, z[0], np.full(3, absurd), how)
    assert (spoilt.updates, spoilt.refused) == (20, 1)
    np.testing.assert_array_equal(spoilt.D, state.D)
    np.testing.assert_array_equal(spoilt.P, state.P)
    again = update(spoilt, z[0], y[0], how)
    np.testing.assert_array_equal(again.D, update(state, z[0], y[0], how).D)


def test_windows_that_do_not_fit_are_refused_by_name(predictor: Predictor) -> None:
    meta, how = predictor.meta, Forgetting()
    state = begin_correction(meta.layout, 0, how)
    z, y = np.zeros((2, meta.width)), np.zeros(6 * meta.N)
    with pytest.raises(PredictorError, match="window: got NaN"):
        take_in(state, predictor, z * np.nan, y, 0, how)
    with pytest.raises(PredictorError, match="window: got shapes"):
        take_in(state, predictor, z[:1], y, 0, how)
    with pytest.raises(PredictorError, match="robot of the correction"):
        begin_correction(meta.layout, 2, how)
    with pytest.raises(PredictorError, match=r"forgetting\.factor"):
        Forgetting(factor=1.5)
    with pytest.raises(PredictorError, match=r"forgetting\.prior"):
        Forgetting(prior=1.0, bound=0.1)
