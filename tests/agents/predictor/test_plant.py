"""Every fit for plants of any size against their true response, and against eq. 6 as written."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.agents.predictor.four_tank import four_tank
from quadriga.agents.predictor.hankel import mosaic
from quadriga.agents.predictor.plant import KINDS, Data, fit, judge
from quadriga.shared.errors import PredictorError
from tests.agents.predictor.plants import Sizes, random_plant, record, split_window

SIZES = st.builds(
    Sizes,
    agents=st.integers(1, 3),
    inputs=st.integers(1, 3),
    outputs=st.integers(1, 3),
    states=st.integers(1, 4),
)
TIMELESS = tuple(kind for kind in KINDS if kind != "periodic")


@settings(max_examples=15, deadline=None)
@given(sizes=SIZES, horizon=st.integers(1, 5), seed=st.integers(0, 1000))
def test_every_kind_gives_the_true_response_of_a_linear_plant(
    sizes: Sizes, horizon: int, seed: int
) -> None:
    past, plant = sizes.states, random_plant(sizes, seed)
    data = record(plant, sizes, (150, 5, 130), seed)
    unseen = record(plant, sizes, (past + horizon,), seed + 1)
    past_u, past_y, future_u, true = split_window(unseen, past, horizon)
    for kind in TIMELESS:
        predictor = fit(data, kind, past, horizon, ridge=1e-12)
        predicted = predictor.predict(past_u, past_y, future_u)
        assert predicted.shape == (horizon, sizes.agents, sizes.outputs)
        assert np.abs(predicted - true).max() < 1e-5 * np.abs(true).max(), kind


@pytest.mark.parametrize("noise", [0.0, 0.3], ids=["of least norm", "with noise"])
@pytest.mark.parametrize("sizes", [Sizes(1, 2, 1, 3), Sizes(2, 1, 2, 4), Sizes(3, 1, 1, 2)])
def test_pinv_is_the_pseudo_inverse_of_equation_6(sizes: Sizes, noise: float) -> None:
    data = record(random_plant(sizes, 1), sizes, (160, 90), 2, noise)
    past, horizon = 3, 4
    flat = [
        (u.reshape(len(u), -1), y.reshape(len(y), -1)) for u, y in zip(data.u, data.y, strict=True)
    ]
    U, Y = (mosaic([pair[k] for pair in flat], past + horizon) for k in (0, 1))
    m, p = sizes.agents * sizes.inputs, sizes.agents * sizes.outputs
    Z = np.vstack([U[: m * past], Y[: p * past], U[m * past :]])
    G = Y[p * past :] @ np.linalg.pinv(Z)
    past_u, past_y, future_u, _ = split_window(data, past, horizon)
    written = G @ np.concatenate([past_u.ravel(), past_y.ravel(), future_u.ravel()])
    found = fit(data, "pinv", past, horizon).predict(past_u, past_y, future_u)
    np.testing.assert_allclose(found.ravel(), written, atol=1e-9)


def test_units_do_not_matter() -> None:
    """The same plant in other units: the same prediction, in them, of every kind."""
    sizes = Sizes(1, 2, 2, 3)
    data = record(random_plant(sizes, 3), sizes, (200,), 4, noise=0.1)
    u_unit, y_unit = np.array([1e-3, 40.0]), np.array([1e4, 0.2])
    other = Data([data.u[0] * u_unit], [data.y[0] * y_unit])
    past_u, past_y, future_u, _ = split_window(data, 3, 4)
    for kind in TIMELESS:
        first, second = (fit(each, kind, 3, 4, ridge=1e-3) for each in (data, other))
        ours = first.predict(past_u, past_y, future_u) * y_unit
        theirs = second.predict(past_u * u_unit, past_y * y_unit, future_u * u_unit)
        np.testing.assert_allclose(theirs, ours, rtol=1e-7, atol=1e-9 * np.abs(ours).max())


def test_a_plant_of_one_agent_needs_no_axis_of_agents() -> None:
    sizes = Sizes(1, 2, 3, 3)
    data = record(random_plant(sizes, 7), sizes, (200,), 8)
    flat = Data(data.u[0][:, 0], data.y[0][:, 0])
    whole, single = (fit(each, "pinv", 3, 4) for each in (data, flat))
    np.testing.assert_array_equal(whole.G, single.G)
    past_u, past_y, future_u, _ = split_window(data, 3, 4)
    np.testing.assert_array_equal(
        single.predict(past_u[:, 0], past_y[:, 0], future_u[:, 0]),
        whole.predict(past_u, past_y, future_u)[:, 0],
    )


def test_peers_weigh_less_if_asked() -> None:
    sizes = Sizes(2, 1, 1, 4)
    data = record(random_plant(sizes, 9), sizes, (200,), 10, noise=0.5)
    plain, weighted = (fit(data, "ridge", 3, 4, ridge=1e-2, peer_weight=w) for w in (1.0, 50.0))
    across, own = ((0, 0, 1), (0, 0, 0))
    assert np.linalg.norm(weighted.blocks[across]) < 0.5 * np.linalg.norm(plain.blocks[across])
    assert np.linalg.norm(weighted.blocks[own]) > 0.5 * np.linalg.norm(plain.blocks[own])


def test_a_judgement_is_of_unseen_windows_against_persistence() -> None:
    sizes, noise = Sizes(2, 1, 2, 4), 0.05
    plant = random_plant(sizes, 11)
    predictor = fit(record(plant, sizes, (900,), 12, noise), "ridge", 4, 5)
    unseen = record(plant, sizes, (60, 3, 50), 13, noise)
    found = judge(predictor, unseen)
    assert found.windows == (60 - 8) + (50 - 8)
    past_u, past_y, future_u, true = split_window(unseen, 4, 5)
    one = judge(predictor, Data([unseen.u[0][:9]], [unseen.y[0][:9]]))
    error = predictor.predict(past_u, past_y, future_u) - true
    np.testing.assert_allclose(one.rmse, np.sqrt((error**2).mean(axis=(0, 1))))
    still = past_y[-1] - true
    np.testing.assert_allclose(one.persistence, np.sqrt((still**2).mean(axis=(0, 1))))
    assert found.ratio < 0.3
    assert (found.rmse > noise * 0.9).all()
    with pytest.raises(PredictorError, match="at least 9 samples"):
        judge(predictor, Data([unseen.u[1]], [unseen.y[1]]))
    with pytest.raises(PredictorError, match="agents, inputs, outputs"):
        judge(predictor, four_tank().data)


DATA = record(random_plant(Sizes(1, 2, 1, 3), 1), Sizes(1, 2, 1, 3), (100,), 1, noise=0.1)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"kind": "pinw"}, "did you mean 'pinv'"),
        ({"past": 0}, "past: got 0, expected a whole number"),
        ({"past": 4.0}, r"past: got 4\.0, expected a whole number"),
        ({"horizon": "10"}, "horizon: got '10', expected a whole number"),
        ({"horizon": 98}, "got episodes of at most 100 samples, expected at least 101"),
        ({"horizon": 40}, r"not persistently exciting of order 43.*rank 58 of 86, 58 columns"),
        ({"kind": "ridge", "ridge": -1.0}, "ridge, peer_weight"),
        ({"kind": "ridge", "ridge": 0.0, "horizon": 40}, "not persistently exciting"),
        ({"kind": "periodic"}, "period"),
        ({"period": 10}, "period"),
        ({"kind": "periodic", "period": 1}, "at least 2"),
        ({"kind": "periodic", "period": 10, "input_map": np.eye(3)}, r"input_map: got shape"),
    ],
)
def test_what_cannot_be_fitted_is_refused_by_name(changes: dict[str, Any], text: str) -> None:
    arguments: dict[str, Any] = {"kind": "pinv", "past": 3, "horizon": 4} | changes
    with pytest.raises(PredictorError, match=text):
        fit(DATA, **arguments)


def test_signals_that_do_not_fit_a_predictor_are_refused_by_name() -> None:
    predictor = fit(DATA, "pinv", 3, 4)
    past_u, past_y, future_u, _ = split_window(DATA, 3, 4)
    with pytest.raises(
        PredictorError, match=r"past_u: got shape \(4, 1, 2\), expected \(3, 1, 2\)"
    ):
        predictor.predict(future_u, past_y, future_u)
    with pytest.raises(PredictorError, match="future_u: got NaN"):
        predictor.predict(past_u, past_y, future_u * np.nan)
    with pytest.raises(ValueError, match="read-only"):
        predictor.blocks[0, 0, 0, 0, 0] = 1.0
