"""Plans with a fitted predictor: the closed form, bounds, and closed loops on the four tanks."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.agents.predictor.control import (
    BoundedQp,
    DataDrivenController,
    Deepc,
    PlanBounds,
    PlanWeights,
)
from quadriga.agents.predictor.four_tank import FourTank, four_tank
from quadriga.agents.predictor.plant import fit
from quadriga.shared.errors import PredictorError
from quadriga.shared.robots.conventions import Array
from tests.agents.predictor.plants import Sizes, random_plant, record, split_window


def test_without_bounds_it_is_the_closed_form_of_equation_7() -> None:
    """For a team of two, in the order in which the whole G has rows and columns."""
    sizes, rng = Sizes(2, 1, 2, 4), np.random.default_rng(1)
    data = record(random_plant(sizes, 1), sizes, (200,), 2, noise=0.1)
    predictor = fit(data, "ridge", 3, 5)
    Q, R = np.array([2.0, 0.5]), 0.3
    r, r_u = rng.normal(size=(5, 2, 2)), rng.normal(size=(5, 2, 1))
    past_u, past_y, _, _ = split_window(data, 3, 5)
    plan = DataDrivenController(predictor, PlanWeights(Q, R)).plan(past_u, past_y, r, r_u)
    G = predictor.G.reshape(-1, 2, predictor.layout.width)
    G_past, G_u = G[..., :9].reshape(20, -1), G[..., 9:].reshape(20, -1)
    past = [np.concatenate([past_u[:, i].ravel(), past_y[:, i].ravel()]) for i in range(2)]
    free, weight = G_past @ np.concatenate(past), np.tile(Q, 10)
    error = free - r.transpose(1, 0, 2).ravel()
    asked = r_u.transpose(1, 0, 2).ravel()
    H = (G_u.T * weight) @ G_u + R * np.eye(10)
    u = np.linalg.solve(H, R * asked - (G_u.T * weight) @ error)
    np.testing.assert_allclose(plan.u.transpose(1, 0, 2).ravel(), u, atol=1e-9)
    np.testing.assert_allclose(plan.y.transpose(1, 0, 2).ravel(), free + G_u @ u, atol=1e-9)
    np.testing.assert_allclose(plan.y, predictor.predict(past_u, past_y, plan.u), atol=1e-9)
    assert plan.g is None
    assert plan.residual < 1e-10


def drive(
    example: FourTank, controller: DataDrivenController | Deepc, steps: int
) -> tuple[Array, Array]:
    """Inputs and outputs of a closed loop from the end of the data."""
    u = list(example.data.u[0][-example.past :, 0])
    y = list(example.data.y[0][-example.past :, 0])
    for _ in range(steps):
        past = np.array(u[-example.past :]), np.array(y[-example.past :])
        plan = controller.plan(*past, example.reference, example.input_reference)
        u.append(plan.u[0])
        y.append(example.plant.respond(plan.u[0]))
    return np.array(u[example.past :]), np.array(y[example.past :])


def test_the_four_tanks_reach_their_levels() -> None:
    for build in (
        lambda e: DataDrivenController(fit(e.data, "pinv", e.past, e.horizon), e.weights),
        lambda e: Deepc(e.data, e.past, e.horizon, e.weights),
    ):
        example = four_tank()
        _, y = drive(example, build(example), 80)
        assert np.abs(y[-1] - example.reference).max() < 0.01, "the set-point is rounded"
        assert np.abs(y[0] - example.reference).max() > 0.1


def test_inputs_and_outputs_stay_within_their_bounds() -> None:
    bounds = PlanBounds(u_min=[-0.5, 0.2], u_max=1.4, y_max=[0.6, np.inf])
    example = four_tank()
    predictor = fit(example.data, "pinv", example.past, example.horizon)
    u, y = drive(example, DataDrivenController(predictor, example.weights, bounds), 60)
    assert (u >= np.array([-0.5, 0.2]) - 1e-7).all()
    assert u.max() == pytest.approx(1.4, abs=1e-7)
    assert y[:, 0].max() <= 0.6 + 1e-6
    assert y[-1, 0] == pytest.approx(0.6, abs=1e-3), "as far as it may"


def test_bounds_that_nothing_keeps_are_one_clear_error() -> None:
    example = four_tank()
    predictor = fit(example.data, "pinv", example.past, example.horizon)
    bounds = PlanBounds(u_min=-0.1, u_max=0.1, y_min=[5.0, -np.inf])
    controller = DataDrivenController(predictor, example.weights, bounds)
    past = np.zeros((4, 2)), np.zeros((4, 2))
    with pytest.raises(PredictorError, match=r"no solution \(infeasible"):
        controller.plan(*past, example.reference)
    with pytest.raises(PredictorError, match=r"reference: got shape \(3,\), expected \(30, 2\)"):
        controller.plan(*past, np.zeros(3))


def test_a_plan_does_not_depend_on_the_plans_before_it() -> None:
    example, rng = four_tank(noise=0.002), np.random.default_rng(2)
    bounds = PlanBounds(u_min=-0.4, u_max=1.1)
    controller = Deepc(example.data, example.past, example.horizon, example.weights, bounds)
    pasts = [(rng.normal(size=(4, 2)), rng.normal(size=(4, 2))) for _ in range(5)]
    first = [controller.plan(*past, example.reference).u for past in pasts]
    again = [controller.plan(*past, example.reference).u for past in reversed(pasts)]
    np.testing.assert_array_equal(first, again[::-1])


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000), k=st.integers(1, 8), reach=st.floats(0.01, 2.0))
def test_a_separable_problem_is_cut_off_at_its_bounds(seed: int, k: int, reach: float) -> None:
    rng = np.random.default_rng(seed)
    H, f = np.diag(rng.uniform(0.5, 2.0, k)), rng.normal(size=k)
    qp = BoundedQp(H, np.zeros((0, k)))
    x, residual = qp.solve(f, np.full(k, -reach), np.full(k, 0.5 * reach))
    np.testing.assert_allclose(x, np.clip(-f / H.diagonal(), -reach, 0.5 * reach), atol=1e-9)
    assert residual < 1e-8


def test_the_nearest_point_of_a_half_plane() -> None:
    qp, free = BoundedQp(np.eye(2), np.array([[1.0, 1.0]])), np.full(2, np.inf)
    x, _ = qp.solve(np.zeros(2), np.append(-free, 2.0), np.append(free, np.inf))
    np.testing.assert_allclose(x, [1.0, 1.0], atol=1e-9)


def test_problems_without_an_answer_are_errors() -> None:
    with pytest.raises(PredictorError, match="orders of magnitude apart"):
        BoundedQp(np.diag([1.0, -1.0]), np.zeros((0, 2)))
    qp = BoundedQp(np.eye(1), np.ones((1, 1)))
    with pytest.raises(PredictorError, match="no solution"):
        qp.solve(np.zeros(1), np.array([-1.0, 2.0]), np.array([1.0, 3.0]))
