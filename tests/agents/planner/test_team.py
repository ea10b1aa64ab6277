"""The team's planner: against eq. 7 solved otherwise, and against agents that plan alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from quadriga.agents.gait import horizon_stance
from quadriga.agents.planner.peers import PeerTerms
from quadriga.agents.planner.planner import Planner, PlannerInputs, PlannerState
from quadriga.agents.planner.team import build_centralised
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.shared.config.sections import Config
from tests.a1 import nominal_forces
from tests.agents.calm import BASE, STEP, inputs_of, team_cost
from tests.agents.conftest import fit_ridge


@pytest.fixture(scope="module")
def predictor(small: Config, linear_team: Callable[..., Any]) -> Predictor:
    meta = replace(PredictorMeta.of(small), ridge=1e-10, block_weight=1.0)
    return fit_ridge([linear_team(2).episode(1500, 1)], meta)


def disturbed(config: Config, seed: int, size: float = 1.0) -> list[PlannerInputs]:
    """Both robots off their course in ways of their own."""
    rng, T_ini, N = np.random.default_rng(seed), config.planner.T_ini, config.planner.N
    stance = np.ones((T_ini, 4), dtype=np.bool_)
    scale = size * np.array([0.004, 0.1, 0.1, 0.02, 0.02, 0.1])
    return [
        inputs_of(
            config,
            u_ini=nominal_forces(stance) + 5.0 * size * rng.normal(size=(T_ini, 12)),
            y_ini=BASE + scale * rng.normal(size=(T_ini, 6)),
            y_des=np.tile(BASE + 0.2 * scale * rng.normal(size=6), (N, 1)),
        )
        for _ in range(config.team.robots)
    ]


@pytest.mark.parametrize(("seed", "size"), [(0, 0.2), (1, 1.0), (2, 3.0)])
def test_no_feasible_change_of_the_forces_is_better(
    small: Config, predictor: Predictor, seed: int, size: float
) -> None:
    """Projected steps down the numerical slope of eq. 7 lead nowhere."""
    inputs = disturbed(small, seed, size)
    result = build_centralised(small, predictor).step(inputs)
    assert result.status == "solved"
    stance = np.stack([horizon_stance(small, i, STEP) for i in range(2)])
    du = result.u - nominal_forces(stance)
    rng = np.random.default_rng(seed)
    best, c = team_cost(small, predictor, inputs, du), small.planner.mu / np.sqrt(2.0)
    mask = np.repeat(stance, 3, axis=2)
    tried = 0
    for _ in range(300):
        other = du + mask * rng.normal(size=du.shape) * rng.choice([0.01, 0.1, 1.0])
        forces = (nominal_forces(stance) + other).reshape(*stance.shape, 3)
        fx, fy, fz = forces[stance].T
        within = np.abs(other.reshape(-1, 3)) <= small.planner.deviation_max
        if within.all() and (np.maximum(abs(fx), abs(fy)) <= c * fz).all() and (fz >= 0).all():
            tried += 1
            assert team_cost(small, predictor, inputs, other) >= best * (1.0 - 1e-12)
    assert tried > 10 or size > 2.0


def test_robots_that_do_not_influence_each_other_plan_as_if_alone(
    small: Config, predictor: Predictor
) -> None:
    apart = predictor.G.copy()
    apart[:, 0, 1] = apart[:, 1, 0] = 0.0
    uncoupled = Predictor(predictor.meta, apart)
    inputs = disturbed(small, 4)
    together = build_centralised(small, uncoupled).step(inputs)
    for i, own in enumerate(inputs):
        planner = Planner(small, i, uncoupled)
        alone = planner.step(PlannerState(), own, PeerTerms())[1]
        np.testing.assert_allclose(together.u[i], alone.u, atol=1e-6)
        np.testing.assert_allclose(together.y[i], alone.y, atol=1e-6)


def test_the_plan_is_what_the_team_will_do(
    small: Config, predictor: Predictor, linear_team: Callable[..., Any]
) -> None:
    team, rng = linear_team(2), np.random.default_rng(5)
    T_ini = small.planner.T_ini
    past = 10.0 * rng.normal(size=(40, 2, 12))
    y = BASE + team.respond(past)
    stance = np.ones((T_ini, 4), dtype=np.bool_)
    inputs = [
        replace(own, u_ini=nominal_forces(stance) + past[-T_ini:, i], y_ini=y[-T_ini:, i])
        for i, own in enumerate(disturbed(small, 6))
    ]
    result = build_centralised(small, predictor).step(inputs)
    planned = np.stack([horizon_stance(small, i, STEP) for i in range(2)])
    du = (result.u - nominal_forces(planned)).transpose(1, 0, 2)
    happened = BASE + team.respond(np.concatenate([past, du]))[40:]
    np.testing.assert_allclose(result.y, happened.transpose(1, 0, 2), atol=1e-6)
