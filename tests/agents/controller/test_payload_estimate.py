"""What a robot carries: estimated from its feet, and part of its rigid body."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from quadriga.agents.controller.payload_estimate import add_load, estimate_load
from quadriga.identification.rollout import Rollout
from quadriga.shared.config.sections import (
    Config,
    EstimatorConfig,
    PlannerConfig,
    TeamConfig,
    WorldConfig,
)
from quadriga.shared.messages import Reference
from quadriga.shared.robots.conventions import GRAVITY
from tests.a1 import TOTAL_MASS
from tests.agents.controller.poses import BODY, MODEL, random_pose


def load_after(seconds: float, forces: list[float], load0: float = 0.0) -> float:
    """The load estimated from feet that bear `forces`, N, filtered over 1 s."""
    load = load0
    for _ in range(round(1000 * seconds)):
        load = estimate_load(load, np.array(forces), TOTAL_MASS, 1e-3 / 1.001)
    return load


@pytest.mark.parametrize("load", [0.0, 4.5, 12.0])
def test_standing_feet_bear_robot_and_load(load: float) -> None:
    weight = (TOTAL_MASS + load) * GRAVITY
    assert load_after(1.0, [0.0, weight / 2, weight / 2, 0.0]) == pytest.approx(
        (1.0 - np.exp(-1.0)) * load, rel=2e-3, abs=1e-12
    )
    assert load_after(10.0, [weight / 4] * 4) == pytest.approx(load, rel=1e-4, abs=1e-12)


def test_a_load_is_never_negative_nor_beyond_what_legs_carry() -> None:
    assert load_after(5.0, [0.0] * 4, load0=3.0) == 0.0
    assert load_after(5.0, [1000.0] * 4) == 25.0


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("load", [0.0, 2.0, 9.0])
def test_the_terms_are_those_of_a_robot_with_that_load(load: float, seed: int) -> None:
    model = MODEL.copy()
    point = pin.Inertia(load, np.array([0.0, 0.0, 0.08]), np.zeros((3, 3)))
    model.inertias[1] = model.inertias[1] + point
    pose, data = random_pose(np.random.default_rng(seed)), model.createData()
    terms = BODY.terms(pose.q, pose.v, load)
    M = pin.crba(model, data, pose.q)
    M = np.triu(M) + np.triu(M, 1).T
    np.testing.assert_allclose(terms.M_inverse @ M, np.eye(18), atol=1e-9)
    expected = pin.rnea(model, data, pose.q, pose.v, np.zeros(18))
    np.testing.assert_allclose(terms.nle, expected, atol=1e-9)


def test_a_load_leaves_the_table_as_it_was() -> None:
    before = BODY.links.copy()
    assert add_load(BODY.links, 5.0)[0, 0] == before[0, 0] + 5.0
    np.testing.assert_array_equal(BODY.links, before)


@pytest.mark.parametrize("payload", [0.0, 6.0])
def test_a_walking_robot_finds_out_what_it_carries(payload: float) -> None:
    config = Config(
        team=TeamConfig(robots=1),
        world=WorldConfig(payload=payload, duration=6.0),
        estimator=EstimatorConfig(),
        planner=PlannerConfig(kind="none"),
    )
    walk = Rollout(
        config,
        None,
        lambda tick: (
            Reference(tick, tick * 10**6, 0.3, 0.0, 0.0, 0.26) if tick % 100 == 0 else None
        ),
    )
    loads = []
    for tick in walk.ticks(6000):
        memory = walk.states["r1"].low_level
        if tick.tick >= 4000 and memory is not None:
            loads.append(memory.load)
    assert not walk.world.fallen()
    assert np.mean(loads) == pytest.approx(payload, abs=0.5)
