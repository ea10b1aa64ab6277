"""Predictors against the true response of a known linear team."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from quadriga.agents.predictor.episode import U_SCALE, Y_SCALE, Layout, everyone, scales
from quadriga.agents.predictor.fits import fit_pinv, fit_ridge
from quadriga.agents.predictor.hankel import split
from quadriga.agents.predictor.predictor import PredictorMeta
from quadriga.shared.config.sections import Config, TeamConfig

Team = Callable[..., Any]


def meta_of(config: Config, **changes: Any) -> PredictorMeta:
    return replace(PredictorMeta.of(config), **changes)


def test_the_response_to_a_pulse_is_the_plants(small: Config, linear_team: Team) -> None:
    """Feedthrough included: u_k acts on y_k, which is taken at the end of the same sample."""
    team = linear_team(2)
    meta = meta_of(small, ridge=1e-10, block_weight=1.0)
    predictor = fit_ridge([team.episode(1500, 1)], meta)
    for j in range(2):
        du = np.zeros((meta.N, 2, 12))
        du[0, j, 2] = 10.0
        true = team.respond(du)
        assert abs(true[0, j, 0]) > 1e-6
        for i in range(2):
            predicted = predictor.future_block(i, j) @ du[:, j].ravel()
            error = (predicted.reshape(-1, 6) - true[:, i]) / Y_SCALE
            assert np.abs(error).max() < 1e-6


def test_the_blocks_sum_to_the_full_G(small: Config, linear_team: Team) -> None:
    """Eq. 9, 10 against Y_f [U_p; Y_p; U_f]† of the whole team, written out from eq. 6."""
    team = linear_team(2)
    data = team.episode(700, 3, noise=0.3)
    predictor = fit_pinv([data], meta_of(small))
    T_ini, N = predictor.meta.T_ini, predictor.meta.N
    u, y = data.scaled_deviations()
    parts = split([u], [y], T_ini, N)
    G = parts.Y_f @ np.linalg.pinv(np.vstack([parts.U_p, parts.Y_p, parts.U_f]))
    du, dy = data.deviations()
    k = 123
    past, future = slice(k, k + T_ini), slice(k + T_ini, k + T_ini + N)
    whole = G @ np.concatenate([u[past].ravel(), y[past].ravel(), u[future].ravel()])
    whole = whole.reshape(N, 2, 6) * Y_SCALE
    for i in range(2):
        blocks = sum(
            predictor.block(i, j)
            @ np.concatenate([du[past, j].ravel(), dy[past, j].ravel(), du[future, j].ravel()])
            for j in range(2)
        )
        np.testing.assert_allclose(blocks.reshape(N, 6), whole[:, i], atol=1e-9)


def test_block_weighted_ridge_solves_its_normal_equations(small: Config, linear_team: Team) -> None:
    """Gradient of the penalised least-squares cost, from the explicit windows, is zero."""
    team = linear_team(2)
    data = team.episode(400, 4, noise=0.3)
    meta = meta_of(small, ridge=1e-2, block_weight=7.0)
    predictor = fit_ridge([data], meta)
    z, y = data.windows(meta.T_ini, meta.N)
    z_scale = np.concatenate(
        [np.full(12 * meta.T_ini, U_SCALE), np.tile(Y_SCALE, meta.T_ini), np.full(96, U_SCALE)]
    )
    y_scale = np.tile(Y_SCALE, meta.N)[:, None]
    Z, count = z / z_scale[:, None], z.shape[2]
    for i in range(2):
        rows = [predictor.block(i, j) * z_scale / y_scale for j in range(2)]
        residual = y[i] / y_scale - sum(G @ Zj for G, Zj in zip(rows, Z, strict=True))
        for j in range(2):
            penalty = 1e-2 * count * (1.0 if i == j else 49.0)
            np.testing.assert_allclose(residual @ Z[j].T, penalty * rows[j], atol=1e-7)


def test_fits_are_reproducible_and_read_only(small: Config, linear_team: Team) -> None:
    data = [linear_team(2).episode(300, 6, noise=0.3)]
    first, second = (fit_ridge(data, meta_of(small)) for _ in range(2))
    np.testing.assert_array_equal(first.G, second.G)
    with pytest.raises(ValueError, match="read-only"):
        first.block(0, 1)[0, 0] = 1.0


TEAM = PredictorMeta.of(Config(team=TeamConfig(robots=4)))


@pytest.mark.parametrize(
    ("yokes", "neighbours", "members"),
    [
        ("chain", "all", everyone(4)),
        ("complete", "yoked", everyone(4)),
        ("chain", "yoked", ((0, 1), (0, 1, 2), (1, 2, 3), (2, 3))),
        ("ring", "yoked", ((0, 1, 3), (0, 1, 2), (1, 2, 3), (0, 2, 3))),
        ("none", "yoked", ((0,), (1,), (2,), (3,))),
    ],
)
def test_members_are_the_robot_itself_and_whoever_explains_it(
    yokes: str, neighbours: str, members: tuple[tuple[int, ...], ...]
) -> None:
    layout = replace(TEAM, yokes=yokes, neighbours=neighbours).layout
    assert layout.members == members
    assert layout.strangers(0) == [j for j in range(4) if j not in members[0]]


def test_sizes_and_scales_are_the_team_s() -> None:
    layout = TEAM.layout
    assert (layout.agents, layout.width, layout.past) == (4, TEAM.width, TEAM.past)
    assert layout.rows == 6 * TEAM.N
    z_scale, y_scale = scales(layout)
    np.testing.assert_array_equal(z_scale[: 12 * TEAM.T_ini], U_SCALE)
    np.testing.assert_array_equal(
        z_scale[12 * TEAM.T_ini : TEAM.past], np.tile(Y_SCALE, TEAM.T_ini)
    )
    np.testing.assert_array_equal(z_scale[TEAM.past :], U_SCALE)
    np.testing.assert_array_equal(y_scale, np.tile(Y_SCALE, TEAM.N))


def test_the_scales_of_any_plant_repeat_for_every_sample() -> None:
    layout = Layout(1, 2, 1, 2, 3, (1.0, 10.0), (5.0,), everyone(1))
    z_scale, y_scale = scales(layout)
    assert z_scale.tolist() == [1, 10, 1, 10, 5, 5, 1, 10, 1, 10, 1, 10]
    assert y_scale.tolist() == [5, 5, 5]
    assert (layout.past, layout.width, layout.rows) == (6, 12, 3)
