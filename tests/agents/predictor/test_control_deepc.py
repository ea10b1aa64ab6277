"""DeePC against eq. 5 written out in g, as a dense QP, and against the robots' elimination."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import daqp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.agents.planner.team import eliminate
from quadriga.agents.predictor.control import (
    DataDrivenController,
    DataDrivenPlan,
    Deepc,
    PlanBounds,
    PlanWeights,
)
from quadriga.agents.predictor.deepc import reduce, reduce_signals
from quadriga.agents.predictor.four_tank import four_tank
from quadriga.agents.predictor.hankel import mosaic
from quadriga.agents.predictor.plant import Data, fit
from quadriga.shared.errors import PredictorError
from quadriga.shared.robots.conventions import Array
from tests.agents.predictor.plants import Sizes, random_plant, record

PAST, HORIZON = 2, 3
SIZES = st.builds(
    Sizes,
    agents=st.integers(1, 2),
    inputs=st.integers(1, 2),
    outputs=st.integers(1, 3),
    states=st.integers(1, 4),
)


@dataclass(frozen=True)
class Case:
    """Data, a past that is not theirs, and references."""

    data: Data
    past_u: Array
    past_y: Array
    reference: Array
    input_reference: Array

    def plan(self, weights: PlanWeights, bounds: PlanBounds | None = None) -> DataDrivenPlan:
        deepc = Deepc(self.data, PAST, HORIZON, weights, bounds or PlanBounds())
        return deepc.plan(self.past_u, self.past_y, self.reference, self.input_reference)


def case_of(sizes: Sizes, seed: int, noise: float) -> Case:
    rng, lead = np.random.default_rng(seed), (sizes.agents,)
    data = record(random_plant(sizes, seed), sizes, (60, 4, 40), seed, noise)
    return Case(
        data,
        rng.normal(size=(PAST, *lead, sizes.inputs)),
        rng.normal(size=(PAST, *lead, sizes.outputs)),
        rng.normal(size=(HORIZON, *lead, sizes.outputs)),
        rng.normal(size=(HORIZON, *lead, sizes.inputs)),
    )


@dataclass(frozen=True)
class WrittenOut:
    """Eq. 5 with σ = Y_p g − y_ini, u = U_f g and y = Y_f g: ½ gᵀ P g + qᵀ g, U_p g = u_ini."""

    U_p: Array
    Y_p: Array
    U_f: Array
    Y_f: Array
    P: Array
    q: Array

    @classmethod
    def of(cls, case: Case, weights: PlanWeights) -> WrittenOut:
        U, Y = (
            mosaic([x.reshape(len(x), -1) for x in xs], PAST + HORIZON)
            for xs in (case.data.u, case.data.y)
        )
        (U_p, U_f), (Y_p, Y_f) = (np.split(X, [len(X) * PAST // (PAST + HORIZON)]) for X in (U, Y))
        Q, R = (
            np.tile(np.broadcast_to(weight, dim), HORIZON * case.data.agents)
            for weight, dim in ((weights.Q, case.data.outputs), (weights.R, case.data.inputs))
        )
        P = (Y_f.T * Q) @ Y_f + (U_f.T * R) @ U_f + weights.lambda_sigma * Y_p.T @ Y_p
        P += weights.lambda_g * np.eye(U.shape[1])
        q = -(Y_f.T * Q) @ case.reference.ravel() - (U_f.T * R) @ case.input_reference.ravel()
        return cls(U_p, Y_p, U_f, Y_f, P, q - weights.lambda_sigma * Y_p.T @ case.past_y.ravel())

    def solve(self, case: Case, bounds: PlanBounds) -> Array:
        """The best g, by a dense active-set method on all of it."""
        free = np.full(len(self.U_f) + len(self.Y_f), 1e30)
        low, high = -free, free.copy()
        for at, (least, most), dim in (
            (slice(0, len(self.U_f)), (bounds.u_min, bounds.u_max), case.data.inputs),
            (slice(len(self.U_f), None), (bounds.y_min, bounds.y_max), case.data.outputs),
        ):
            repeats = len(low[at]) // dim
            low[at] = np.maximum(np.tile(np.broadcast_to(least, dim), repeats), -1e30)
            high[at] = np.minimum(np.tile(np.broadcast_to(most, dim), repeats), 1e30)
        u_ini = case.past_u.ravel()
        g, _, flag, _ = daqp.solve(
            self.P,
            self.q,
            np.vstack([self.U_p, self.U_f, self.Y_f]),
            np.concatenate([u_ini, high]),
            np.concatenate([u_ini, low]),
            np.concatenate([np.full(len(u_ini), 5), np.zeros(len(low))]).astype(np.int32),
            primal_tol=1e-10,
        )
        assert flag == 1
        return np.asarray(g)

    def check(self, plan: DataDrivenPlan, g: Array, case: Case, atol: float) -> None:
        assert plan.g is not None
        assert plan.sigma is not None
        np.testing.assert_allclose(plan.g, g, atol=atol)
        np.testing.assert_allclose(plan.u.ravel(), self.U_f @ g, atol=atol)
        np.testing.assert_allclose(plan.y.ravel(), self.Y_f @ g, atol=atol)
        np.testing.assert_allclose(
            plan.sigma.ravel(), self.Y_p @ g - case.past_y.ravel(), atol=atol
        )
        # The plan's own g says the same as the plan.
        np.testing.assert_allclose(self.U_p @ plan.g, case.past_u.ravel(), atol=atol)
        np.testing.assert_allclose(self.U_f @ plan.g, plan.u.ravel(), atol=atol)
        np.testing.assert_allclose(self.Y_f @ plan.g, plan.y.ravel(), atol=atol)


@settings(max_examples=25, deadline=None)
@given(
    sizes=SIZES,
    seed=st.integers(0, 1000),
    noise=st.sampled_from([0.0, 0.1]),
    lambda_g=st.floats(0.1, 100.0),
    lambda_sigma=st.floats(1.0, 1e4),
)
def test_without_bounds_it_is_the_saddle_point_of_equation_5(
    sizes: Sizes, seed: int, noise: float, lambda_g: float, lambda_sigma: float
) -> None:
    case, weights = case_of(sizes, seed, noise), PlanWeights(2.0, 0.3, lambda_g, lambda_sigma)
    written = WrittenOut.of(case, weights)
    zero = np.zeros((len(written.U_p),) * 2)
    K = np.block([[written.P, written.U_p.T], [written.U_p, zero]])
    g = np.linalg.solve(K, np.concatenate([-written.q, case.past_u.ravel()]))[: len(written.q)]
    plan = case.plan(weights)
    assert plan.u.shape == case.input_reference.shape
    assert plan.residual < 1e-9
    written.check(plan, g, case, 1e-6)


@settings(max_examples=25, deadline=None)
@given(
    sizes=SIZES,
    seed=st.integers(0, 1000),
    noise=st.sampled_from([0.0, 0.1]),
    lambda_g=st.floats(0.1, 100.0),
    tightness=st.floats(0.3, 0.9),
    outputs=st.booleans(),
)
def test_with_active_bounds_it_is_equation_5(
    sizes: Sizes, seed: int, noise: float, lambda_g: float, tightness: float, outputs: bool
) -> None:
    case, weights = case_of(sizes, seed, noise), PlanWeights(2.0, 0.3, lambda_g, 100.0)
    free = case.plan(weights)
    reach = tightness * np.abs(free.u).max(axis=(0, 1))
    bounds = PlanBounds(u_min=-reach, u_max=reach)
    if outputs:  # those of a plan that can be carried out, so that there is one
        held = case.plan(weights, bounds).y
        bounds = PlanBounds(y_max=0.5 * (held.max(axis=(0, 1)) + free.y.max(axis=(0, 1))))
    plan = case.plan(weights, bounds)
    assert np.abs(plan.u - free.u).max() > 0.0 or outputs
    written = WrittenOut.of(case, weights)
    written.check(plan, written.solve(case, bounds), case, 1e-5)


@settings(max_examples=10, deadline=None)
@given(sizes=SIZES, seed=st.integers(0, 1000), noise=st.sampled_from([0.0, 0.1]))
def test_the_robots_elimination_has_the_same_plan_for_any_plant(
    sizes: Sizes, seed: int, noise: float
) -> None:
    case, weights = case_of(sizes, seed, noise), PlanWeights(2.0, 0.3, 5.0, 100.0)
    layout = case.data.layout(PAST, HORIZON)
    square = np.array(layout.y_scale) ** 2
    model = eliminate(
        reduce_signals(case.data.scaled(layout), layout),
        np.full(sizes.outputs, 2.0),
        np.full(sizes.inputs, 0.3),
        5.0,
        100.0 * square,
    )
    past = np.concatenate(
        [
            np.concatenate([case.past_u[:, i].ravel(), case.past_y[:, i].ravel()])
            for i in range(sizes.agents)
        ]
    )
    y_des = case.reference.transpose(1, 0, 2).ravel()
    u = -np.linalg.solve(model.H, model.F_past @ past + model.F_des @ y_des)
    deepc = Deepc(case.data, PAST, HORIZON, weights)
    plan = deepc.plan(case.past_u, case.past_y, case.reference)
    np.testing.assert_allclose(plan.u.transpose(1, 0, 2).ravel(), u, atol=1e-7)
    y = model.free(past, y_des) + model.Y_v @ u
    np.testing.assert_allclose(plan.y.transpose(1, 0, 2).ravel(), y, atol=1e-7)


def test_without_noise_it_plans_what_spc_plans() -> None:
    """λ_g small and λ_σ large: the past alone decides, as in eq. 7."""
    example = four_tank()
    u = np.random.default_rng(3).uniform(-1.0, 1.0, (4, 2))
    past = u, example.plant.respond(u)
    weights = PlanWeights(Q=3.0, R=1e-2, lambda_g=1e-10, lambda_sigma=1e8)
    deepc = Deepc(example.data, 4, 12, weights)
    predictor = fit(example.data, "pinv", 4, 12)
    references = example.reference, example.input_reference
    ours = DataDrivenController(predictor, weights).plan(*past, *references)
    plan = deepc.plan(*past, *references)
    np.testing.assert_allclose(plan.u, ours.u, atol=1e-5)
    np.testing.assert_allclose(plan.y, ours.y, atol=1e-6)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"data": four_tank(samples=60).data}, r"not persistently exciting of order 30"),
        ({"data": four_tank(samples=20).data}, "at least 30"),
        ({"weights": PlanWeights(lambda_g=0.0)}, r"weights\.lambda_g"),
        ({"weights": PlanWeights(Q=-1.0)}, r"weights\.Q"),
        ({"weights": PlanWeights(R=0.0)}, r"weights\.R"),
        ({"weights": PlanWeights(R=[1.0, 1.0, 1.0])}, r"weights\.R: got shape"),
        ({"bounds": PlanBounds(u_min=2.0, u_max=1.0)}, r"bounds\.u_min"),
        ({"bounds": PlanBounds(y_max=[1.0])}, r"bounds\.y_max"),
    ],
)
def test_what_cannot_be_planned_is_refused_by_name(changes: dict[str, Any], text: str) -> None:
    arguments: dict[str, Any] = {"data": four_tank().data, "past": 4, "horizon": 26}
    with pytest.raises(PredictorError, match=text):
        Deepc(**(arguments | changes))


Team = Callable[..., Any]
T_INI, N = 2, 3


def test_data_without_noise_have_the_rank_of_the_plant(linear_team: Team) -> None:
    """Fundamental lemma: forces fill all their directions, outputs add one per state."""
    for n in (1, 2):
        plant = linear_team(n)
        clean, noisy = (
            reduce(
                [plant.episode(samples * n, samples, noise=noise) for samples in (70, 55)], T_INI, N
            )
            for noise in (0.0, 0.3)
        )
        assert clean.spread.shape == (6 * n * (T_INI + N), 9 * n)
        assert noisy.spread.shape == (6 * n * (T_INI + N), 6 * n * (T_INI + N))


def test_short_or_dull_data_are_refused(linear_team: Team) -> None:
    episode = linear_team(1).episode(40, 0)
    with pytest.raises(PredictorError, match="persistently exciting of order 5"):
        reduce([episode], T_INI, N)
    still = linear_team(1).episode(200, 0)
    u = still.u.copy()
    u[:, :, 3] = still.u_nominal[:, :, 3]
    with pytest.raises(PredictorError, match="persistently exciting"):
        reduce([replace(still, u=u)], T_INI, N)
    with pytest.raises(PredictorError, match="data of one team"):
        reduce([], T_INI, N)
    with pytest.raises(PredictorError, match="data of one team"):
        reduce([still, linear_team(2).episode(200, 0)], T_INI, N)
