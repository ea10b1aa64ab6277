"""Every fit for plants of any size against their true response, and against eq. 6 as written."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.agents.predictor.four_tank import four_tank
from quadriga.agents.predictor.hankel import mosaic
from quadriga.agents.predictor.plant import (
    KINDS,
    Data,
    fit,
    is_persistently_exciting,
    judge,
    load,
    save,
)
from quadriga.shared.errors import PredictorError, PredictorFileError
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


U, Y = np.random.default_rng(0).normal(size=(30, 2)), np.zeros((30, 1))


@pytest.mark.parametrize(
    ("u", "y", "text"),
    [
        ([], [], r"data\.u: got no episode"),
        ([U], [Y, Y], "inputs of 1 episodes"),
        ([U], [Y[:20]], "as many samples"),
        ([U[:, 0]], [Y], r"data\.u: got shape \(30,\)"),
        ([U, U[:, :1]], [Y, Y], "alike in all episodes"),
        ([U[:, None]], [Y], "as many samples and agents"),
        ([U * np.inf], [Y], r"data\.u: got NaN or infinity"),
        ([["a"]], [Y], "an array of numbers"),
        ([U + 1j], [Y], r"data\.u: got complex numbers"),
        ([np.ma.masked_less(U, 0.0)], [Y], r"data\.u: got masked samples"),
        ([U * 1e200], [Y], r"data\.u: got .*e\+200, expected numbers up to"),
    ],
)
def test_data_that_do_not_belong_together_are_refused(u: Any, y: Any, text: str) -> None:
    with pytest.raises(PredictorError, match=text):
        Data(u, y)


def test_a_constant_input_is_refused_and_a_mean_is_warned_of() -> None:
    still = U.copy()
    still[:, 1] = 7.3
    with pytest.raises(PredictorError, match=r"data\.u: got columns \[1\] constant"):
        fit(Data(still, Y), kind="ridge", past=2, horizon=2)
    with pytest.warns(UserWarning, match=r"data\.y has a mean beyond .* no intercept"):
        fit(Data(U, U[:, :1] + 5.0), kind="ridge", past=2, horizon=2)


def test_data_are_copied_and_read_only() -> None:
    u = U.copy()
    data = Data(u, Y)
    u[:] = 0.0
    np.testing.assert_array_equal(data.u[0][:, 0], U)
    assert (data.agents, data.inputs, data.outputs, data.samples) == (1, 2, 1, 30)
    with pytest.raises(ValueError, match="read-only"):
        data.u[0][0] = 1.0
    with pytest.raises(PredictorError, match=r"data\.first"):
        Data(U, Y, first=[0, 1])


def test_noise_excites_and_a_sine_does_not() -> None:
    assert is_persistently_exciting(U, 10)
    assert not is_persistently_exciting(U, 11)  # 20 columns, 22 rows
    assert is_persistently_exciting([U, U[::-1]], 11)
    for wrong in (U[:1], U[:, 0], [U, U[:, :1]]):
        with pytest.raises(PredictorError, match="signal"):
            is_persistently_exciting(wrong, 3)
    sine = np.sin(0.3 * np.arange(60.0))[:, None]
    assert is_persistently_exciting(sine, 2)
    assert not is_persistently_exciting(sine, 3)


def test_what_is_saved_is_loaded(tmp_path: Path) -> None:
    example, path = four_tank(noise=0.002), tmp_path / "new" / "tanks.npz"
    predictor = fit(example.data, "ridge", 4, 8)
    save(path, predictor)
    again = load(path)
    np.testing.assert_array_equal(again.blocks, predictor.blocks)
    assert (again.kind, again.layout, again.single) == ("ridge", predictor.layout, True)
    assert again.condition == predictor.condition
    assert [file.name for file in path.parent.iterdir()] == ["tanks.npz"]


def test_damaged_and_foreign_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "tanks.npz"
    with pytest.raises(PredictorFileError, match="no such file"):
        load(path)
    save(path, fit(four_tank().data, "pinv", 4, 8))
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(PredictorFileError, match="something else"):
        load(path)
    np.savez(path, document=np.array('{"format": "another"}'), blocks=np.zeros((1, 1)))
    with pytest.raises(PredictorFileError, match="format another"):
        load(path)
    path.write_bytes(content)
    with np.load(path) as archive:
        np.savez(path, document=archive["document"], blocks=archive["blocks"] + 1.0)
    with pytest.raises(PredictorFileError, match="digest"):
        load(path)
    with pytest.raises(PredictorFileError, match="a file that can be written"):
        save(tmp_path, fit(four_tank().data, "pinv", 4, 8))
