"""Layouts, predictors and fits: of a known linear team, and of a plant that is no team."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from quadriga.agents.predictor.episode import Y_SCALE, Episode, everyone, wrench_map
from quadriga.agents.predictor.predictor import KINDS, PredictorMeta, fit, fit_plant
from quadriga.agents.predictor.store import predictor_sha256
from quadriga.shared.config.sections import Config, TeamConfig
from quadriga.shared.errors import PredictorError
from quadriga.shared.robots.registry import ROBOTS
from quadriga.shared.runtime.arithmetic import use_one_blas_thread
from tests.agents.conftest import fit_ridge
from tests.agents.predictor.plants import Sizes, first_window, random_plant, record

Team = Callable[..., Any]
TEAM = PredictorMeta.of(Config(team=TeamConfig(robots=4)))


def test_the_response_to_a_pulse_is_the_plants(small: Config, linear_team: Team) -> None:
    """Feedthrough included: u_k acts on y_k, which is taken at the end of the same sample."""
    team = linear_team(2)
    meta = replace(PredictorMeta.of(small), ridge=1e-10, block_weight=1.0)
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


@pytest.mark.parametrize("kind", KINDS)
def test_fits_are_reproducible_and_read_only(kind: str, small: Config, linear_team: Team) -> None:
    use_one_blas_thread()
    data, meta = [linear_team(2).episode(500, 6, noise=0.3)], PredictorMeta.of(small)
    meta = replace(meta, kind=kind)
    first, second = (fit(data, meta) for _ in range(2))
    assert predictor_sha256(first) == predictor_sha256(second)
    with pytest.raises(ValueError, match="read-only"):
        next(iter(first.arrays().values()))[0, 0, 0] = 1.0


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
    assert replace(TEAM, yokes=yokes, neighbours=neighbours).layout.members == members


@pytest.mark.parametrize("kind", ROBOTS)
def test_the_wrench_is_that_of_the_forces_at_the_feet(kind: str) -> None:
    force = np.random.default_rng(1).normal(size=(4, 3))
    feet = np.column_stack([ROBOTS[kind].feet_under_hips, np.zeros(4)])
    wrench, unit = wrench_map(kind) @ force.ravel(), wrench_map(kind)[0, 0]
    np.testing.assert_allclose(wrench[:3], force.sum(axis=0) * unit)
    moment, lever = np.cross(feet, force).sum(axis=0), np.linalg.norm(feet[0])
    np.testing.assert_allclose(wrench[3:], moment * unit / lever, atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_data_that_no_fit_can_use_are_refused_by_name(
    kind: str, small: Config, linear_team: Team
) -> None:
    meta, good = replace(PredictorMeta.of(small), kind=kind), linear_team(2).episode(100, 16)
    with pytest.raises(PredictorError, match="at least one"):
        fit([], meta)
    with pytest.raises(PredictorError, match=r"got \(agents, inputs, outputs\) = \(2, 12, 6\)"):
        fit([good], replace(meta, robots=3))
    short = Episode(good.u[:6], good.u_nominal[:6], good.y[:6], good.y_base[:6], 410)
    with pytest.raises(PredictorError, match="got 6 samples, expected at least 12"):
        fit([good, short], meta)


# ---- any plant


def test_a_plant_of_one_agent_needs_no_axis_of_agents() -> None:
    sizes = Sizes(1, 2, 3, 3)
    (data,) = record(random_plant(sizes, 7), sizes, (200,), 8)
    flat = Episode.of(data.u[:, 0], data.y[:, 0].tolist())
    whole, single = (fit_plant([each], "pinv", 3, 4) for each in (data, flat))
    np.testing.assert_array_equal(whole.G, single.G)
    past_u, past_y, future_u, _ = first_window(data, 3, 4)
    np.testing.assert_array_equal(
        single.forecast(past_u[:, 0], past_y[:, 0], future_u[:, 0]),
        whole.forecast(past_u, past_y, future_u)[:, 0],
    )
    with pytest.raises(PredictorError, match=r"past_u: got shape \(4, 1, 2\), expected \(3, 1, 2"):
        whole.forecast(future_u, past_y, future_u)


U, Y = np.random.default_rng(0).normal(size=(100, 2)), np.zeros((100, 1))


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"kind": "pinw"}, "did you mean 'pinv'"),
        ({"T_ini": 0}, "T_ini: got 0, expected a whole number"),
        ({"T_ini": 4.0}, r"T_ini: got 4\.0, expected a whole number"),
        ({"N": "10"}, "N: got '10', expected a whole number"),
        ({"kind": "ridge", "ridge": -1.0}, "ridge, block_weight: got -1"),
        ({"episodes": [Episode.of(U * [1.0, 0.0] + [0.0, 7.3], Y)]}, r"u: got columns \[1\] const"),
        ({"N": 98}, "got 100 samples, expected at least 101"),
        ({"N": 40}, "rank below 86, expected rank 86: persistently exciting of order 43"),
        ({"kind": "ridge", "ridge": 0.0, "N": 40}, "persistently exciting"),
        ({"kind": "periodic"}, "period: got 1 of 'periodic'"),
        ({"period": 10}, "period: got 10 of 'pinv'"),
        ({"kind": "periodic", "period": 10, "input_map": np.eye(3)}, r"input_map: got shape"),
        ({"episodes": []}, "episodes: got none"),
        ({"episodes": [Episode.of(U, Y), Episode.of(U[:, :1], Y)]}, "of another plant"),
    ],
)
def test_what_cannot_be_fitted_is_refused_by_name(changes: dict[str, Any], text: str) -> None:
    arguments: dict[str, Any] = {"episodes": [Episode.of(U, Y)], "T_ini": 3, "N": 4}
    with pytest.raises(PredictorError, match=text):
        fit_plant(**(arguments | changes))


@pytest.mark.parametrize(
    ("u", "y", "text"),
    [
        (U, Y[:20], r"episode\.y: got shape \(20, 1, 1\)"),
        (U[:, 0], Y, r"u: got shape \(100,\)"),
        (U * np.inf, Y, r"u: got NaN, infinity or too large numbers"),
        (U * 1e200, Y, r"u: got NaN, infinity or too large numbers"),
        (U + 1j, Y, "an array of real numbers"),
        (np.ma.masked_less(U, 0.0), Y, "u: got masked samples"),
        ([["a"]], Y, "an array of real numbers"),
        ([[10**400]], Y, "an array of real numbers"),
    ],
)
def test_signals_that_do_not_belong_together_are_refused(u: Any, y: Any, text: str) -> None:
    with pytest.raises(PredictorError, match=text):
        Episode.of(u, y)


def test_a_mean_is_warned_of() -> None:
    with pytest.warns(UserWarning, match="y has a mean beyond its standard deviation"):
        fit_plant([Episode.of(U, U[:, :1] + 5.0)], "ridge", 3, 4)
