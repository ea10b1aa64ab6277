"""The periodic fit for a plant that is no robot: its response at every phase is known."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.agents.predictor.control import DataDrivenController, PlanWeights
from quadriga.agents.predictor.plant import Data, fit, judge
from quadriga.shared.robots.conventions import Array

PERIOD, PAST, HORIZON, FORGETS = 20, 3, 6, 0.8
# Three inputs act by two numbers on each of two agents; agent 1 feels agent 0.
ACTIONS = np.array([[1.0, -1.0, 0.0], [0.5, 0.5, 2.0]])


def gain(place: float) -> Array:
    """From the actions of all agents to the outputs of all, at a place in the period."""
    wave = np.cos(2 * np.pi * place / PERIOD)
    own = np.array([[1.0 + 0.6 * wave, 0.2], [-0.3, 0.8 - 0.5 * wave]])
    across = np.array([[0.6, 0.0], [0.3 * wave, 0.5]])
    return np.block([[own, np.zeros((2, 2))], [across, own]])


def respond(u: Array, first: int, y: Array) -> Array:
    """y_k = 0.8 y_{k−1} + gain(k) w_k. Shape (T, 2, 2)."""
    outputs = []
    for k, now in enumerate(u):
        y = FORGETS * y + gain(first + k) @ (now @ ACTIONS.T).ravel()
        outputs.append(y.reshape(2, 2))
    return np.array(outputs)


def record(seed: int, samples: int, first: int, hold: int = 1) -> Data:
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.normal(size=(samples // hold, 2, 3)), hold, axis=0)
    y = respond(u, first, np.zeros(4)) + 0.05 * rng.normal(size=(len(u), 2, 2))
    return Data([u], [y], first=[first])


@pytest.mark.parametrize("hold", [1, 2])
def test_the_response_at_every_phase_is_found(hold: int) -> None:
    predictor = fit(
        record(1, 3000, 7, hold), "periodic", PAST, HORIZON, period=PERIOD, input_map=ACTIONS
    )
    assert predictor.period == PERIOD
    assert predictor.blocks.shape == (PERIOD, 2, 2, 2 * HORIZON, predictor.layout.width)
    unseen = record(2, 400, 3)
    found = judge(predictor, unseen)
    timeless = judge(fit(record(1, 3000, 7, hold), "ridge", PAST, HORIZON), unseen)
    assert found.ratio < 0.5 * timeless.ratio
    assert not predictor.blocks[:, 0, 1].any(), "agent 1 does nothing to agent 0"
    for phase in (0, 13):
        forced = predictor.blocks[phase, 1, 0][:, predictor.layout.past :]
        forced = forced.reshape(HORIZON, 2, HORIZON, 3)
        true = np.zeros_like(forced)
        for s in range(HORIZON):
            for t in range(s, HORIZON):
                effect = gain(phase + s)[2:, :2] @ ACTIONS
                true[t, :, s] = FORGETS ** (t - s) * effect
        assert np.linalg.norm(forced - true) < 0.2 * np.linalg.norm(true)


def test_plans_depend_on_the_phase_and_are_predicted_by_it() -> None:
    predictor = fit(record(1, 2000, 0), "periodic", PAST, HORIZON, period=PERIOD)
    controller = DataDrivenController(predictor, PlanWeights(R=0.1))
    past, reference = (np.zeros((PAST, 2, 3)), np.zeros((PAST, 2, 2))), np.ones((2, 2))
    plans = [controller.plan(*past, reference, phase=phase) for phase in (0, 10, 20)]
    np.testing.assert_array_equal(plans[0].u, plans[2].u)
    assert np.abs(plans[0].u - plans[1].u).max() > 0.01
    np.testing.assert_allclose(
        plans[1].y, predictor.predict(*past, plans[1].u, phase=10), atol=1e-9
    )
