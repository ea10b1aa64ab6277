"""Fits by one regression and DeePC's reduction, against eq. 6 and normal equations written out."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.agents.predictor.episode import Episode, Layout, everyone
from quadriga.agents.predictor.hankel import hankel, split
from quadriga.agents.predictor.predictor import PredictorMeta, fit, fit_plant
from quadriga.agents.predictor.regression import normal_equations, reduce, solve_ridge, to_physical
from quadriga.shared.errors import PredictorError
from quadriga.shared.robots.conventions import Array
from tests.agents.predictor.plants import Sizes, first_window, random_plant, record

SIZES = st.builds(
    Sizes,
    agents=st.integers(1, 3),
    inputs=st.integers(1, 3),
    outputs=st.integers(1, 3),
    states=st.integers(1, 4),
)
T_INI, N = 3, 4


def layout_of(agents: int, members: Any = None) -> Layout:
    """Of agents with two inputs and one output, in scales that are not 1."""
    scales = (2.0, 0.5), (3.0,)
    return Layout(agents, 2, 1, T_INI, N, *scales, members or everyone(agents))


def data_of(agents: int, noise: float = 0.3, samples: int = 300) -> list[Episode]:
    sizes = Sizes(agents, 2, 1, 2 * agents)
    return record(random_plant(sizes, 7), sizes, (samples,), 8, noise)


@settings(max_examples=15, deadline=None)
@given(sizes=SIZES, horizon=st.integers(1, 5), seed=st.integers(0, 1000))
def test_every_kind_gives_the_true_response_of_a_linear_plant(
    sizes: Sizes, horizon: int, seed: int
) -> None:
    past, plant = sizes.states, random_plant(sizes, seed)
    data = record(plant, sizes, (150, 130), seed)
    (unseen,) = record(plant, sizes, (past + horizon,), seed + 1)
    past_u, past_y, future_u, true = first_window(unseen, past, horizon)
    for kind in ("pinv", "ridge"):
        predictor = fit_plant(data, kind, past, horizon, ridge=1e-12)
        predicted = predictor.forecast(past_u, past_y, future_u)
        assert predicted.shape == (horizon, sizes.agents, sizes.outputs)
        assert np.abs(predicted - true).max() < 1e-5 * np.abs(true).max(), kind


@pytest.mark.parametrize("noise", [0.0, 0.3], ids=["of least norm", "with noise"])
@pytest.mark.parametrize("sizes", [Sizes(1, 2, 1, 3), Sizes(2, 1, 2, 4), Sizes(3, 1, 1, 2)])
def test_pinv_is_the_pseudo_inverse_of_equation_6(sizes: Sizes, noise: float) -> None:
    data = record(random_plant(sizes, 1), sizes, (160, 90), 2, noise)
    u, y = ([getattr(e, name).reshape(e.samples, -1) for e in data] for name in ("u", "y"))
    U_p, Y_p, U_f, Y_f = split(u, y, T_INI, N)
    G = Y_f @ np.linalg.pinv(np.vstack([U_p, Y_p, U_f]))
    past_u, past_y, future_u, _ = first_window(data[0], T_INI, N)
    written = G @ np.concatenate([past_u.ravel(), past_y.ravel(), future_u.ravel()])
    found = fit_plant(data, "pinv", T_INI, N).forecast(past_u, past_y, future_u)
    np.testing.assert_allclose(found.ravel(), written, atol=1e-9)


def test_units_do_not_matter() -> None:
    """The same plant in other units: the same prediction, in them."""
    sizes, u_unit, y_unit = Sizes(1, 2, 2, 3), np.array([1e-3, 40.0]), np.array([1e4, 0.2])
    data = record(random_plant(sizes, 3), sizes, (200,), 4, noise=0.1)
    other = [Episode.of(data[0].u * u_unit, data[0].y * y_unit)]
    past_u, past_y, future_u, _ = first_window(data[0], T_INI, N)
    for kind in ("pinv", "ridge"):
        first, second = (fit_plant(each, kind, T_INI, N, ridge=1e-3) for each in (data, other))
        ours = first.forecast(past_u, past_y, future_u) * y_unit
        theirs = second.forecast(past_u * u_unit, past_y * y_unit, future_u * u_unit)
        np.testing.assert_allclose(theirs, ours, rtol=1e-7, atol=1e-9 * np.abs(ours).max())


@pytest.mark.parametrize(("agents", "weight"), [(1, 160.0), (2, 7.0), (3, 160.0), (5, 1e4)])
def test_ridge_solves_its_normal_equations(agents: int, weight: float) -> None:
    """Gradient of the penalised least-squares cost, from the explicit windows, is zero."""
    layout, data = layout_of(agents), data_of(agents)
    x = solve_ridge(normal_equations(data, layout), layout, 1e-2, weight)
    z_scale, y_scale = layout.scales()
    G = to_physical(x, layout) * z_scale / y_scale[:, None]
    z, y = data[0].windows(T_INI, N)
    Z = z / z_scale[:, None]
    for i in range(agents):
        residual = y[i] / y_scale[:, None] - sum(G[i, j] @ Z[j] for j in range(agents))
        for j in range(agents):
            penalty = 1e-2 * z.shape[2] * (1.0 if i == j else weight**2)
            np.testing.assert_allclose(residual @ Z[j].T, penalty * G[i, j], atol=1e-7)


@pytest.mark.parametrize("kind", ["pinv", "ridge"])
def test_agents_that_are_no_members_are_left_out_and_change_nothing(kind: str) -> None:
    """The middle of a chain of three, against the fit of its first two agents alone."""
    chain, data = ((0, 1), (0, 1, 2), (1, 2)), data_of(3)
    meta = PredictorMeta(3, N, T_INI, kind, 1, 1e-3, 20.0, plant=layout_of(3, chain))
    whole = fit(data, meta)
    for i in range(3):
        for j in range(3):
            assert whole.block(i, j).any() == (abs(i - j) <= 1)
    cut = [Episode.of(data[0].u[:, :2], data[0].y[:, :2])]
    pair = fit(cut, replace(meta, robots=2, plant=layout_of(2)))
    for j in range(2):
        np.testing.assert_allclose(whole.block(0, j), pair.block(0, j), atol=1e-10)


def test_inputs_that_do_not_excite_are_refused_without_a_penalty() -> None:
    data = data_of(1)
    dead = [replace(data[0], u=data[0].u * [1.0, 0.0])]
    twins = [replace(data[0], u=data[0].u[:, :, [0, 0]])]
    regression = normal_equations(dead, layout_of(1))
    with pytest.raises(PredictorError, match=r"a larger ridge \(identification\.ridge\)"):
        solve_ridge(regression, layout_of(1), 0.0, 1.0)
    with pytest.raises(PredictorError, match="rank below 14, expected rank 14"):
        fit_plant(twins, "pinv", T_INI, N)
    with pytest.raises(PredictorError, match="persistently exciting of order 7"):
        reduce(dead, layout_of(1))


def agents_first(H: Array, agents: int) -> Array:
    """Rows (time, agent, component) of a Hankel matrix, past before future, each agent by agent."""
    rows = H.reshape(T_INI + N, agents, -1, H.shape[1])
    parts = (rows[:T_INI], rows[T_INI:])
    return np.concatenate([x.swapaxes(0, 1).reshape(-1, H.shape[1]) for x in parts])


@pytest.mark.parametrize("agents", [1, 2])
def test_the_reduction_explains_the_data_and_has_the_rank_of_the_plant(agents: int) -> None:
    """Fundamental lemma: inputs fill all their directions, outputs add one per state."""
    layout = layout_of(agents)
    L, states = T_INI + N, 2 * agents
    for noise, rank in ((0.0, states), (0.3, agents * L)):
        data = data_of(agents, noise)
        found = reduce(data, layout)
        assert found.spread.shape == (agents * L, rank)
        H_a, H_b = (agents_first(hankel(x, L), agents) for x in data[0].scaled_deviations(layout))
        np.testing.assert_allclose(found.inverse @ H_a @ H_a.T, np.eye(len(H_a)), atol=1e-8)
        np.testing.assert_allclose(found.response @ H_a @ H_a.T, H_b @ H_a.T, atol=1e-7)
        left = H_b - found.response @ H_a
        np.testing.assert_allclose(found.spread @ found.spread.T, left @ left.T, atol=1e-7)
