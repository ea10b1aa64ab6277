"""What a robot carries, as part of its rigid body; friction that is counted on."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from quadriga.agents.estimator.payload_friction import (
    MU_MIN,
    MU_RECOVERY,
    SLIP_LOAD,
    update_mu_reduction,
    update_payload,
)
from quadriga.identification.rollout import Rollout
from quadriga.shared.config.sections import Config, PlannerConfig, TeamConfig, WorldConfig
from quadriga.shared.robots.conventions import GRAVITY, Array
from quadriga.team.operator import references_of
from tests.a1 import TOTAL_MASS
from tests.agents.estimator.poses import GAINS, blank, gains_of

TROT = np.array([1.0, 0.0, 0.0, 1.0])
MU, SPEED = float(GAINS.mu), float(GAINS.slip_speed)


def payload_after(seconds: float, forces: list[float], before: float = 0.0) -> float:
    """The load estimated from feet that bear `forces`, N, filtered over 1 s."""
    state = blank()
    state.foot_force, state.payload = forces, before
    for _ in range(round(1000 * seconds)):
        update_payload(state, GAINS)
    return float(state.payload)


@pytest.mark.parametrize("load", [0.0, 4.5, 12.0])
def test_standing_feet_bear_robot_and_load(load: float) -> None:
    weight = (TOTAL_MASS + load) * GRAVITY
    assert payload_after(1.0, [0.0, weight / 2, weight / 2, 0.0]) == pytest.approx(
        (1.0 - np.exp(-1.0)) * load, rel=2e-3, abs=1e-12
    )
    assert payload_after(10.0, [weight / 4] * 4) == pytest.approx(load, rel=1e-4, abs=1e-12)


def test_a_load_is_never_negative_nor_beyond_what_legs_carry() -> None:
    assert payload_after(5.0, [0.0] * 4, before=3.0) == 0.0
    assert payload_after(5.0, [1000.0] * 4) == 25.0


@pytest.mark.parametrize("payload", [0.0, 6.0])
def test_a_walking_robot_finds_out_what_it_carries(payload: float) -> None:
    config = Config(
        team=TeamConfig(robots=1),
        world=WorldConfig(payload=payload, duration=6.0),
        planner=PlannerConfig(kind="none"),
    )
    walk, loads = Rollout(config, None, references_of(config)), []
    for tick in walk.ticks(6000):
        state = walk.states["r1"].controller_state
        if tick.tick >= 4000 and state is not None:
            loads.append(state.payload)
    assert not walk.world.fallen()
    assert np.mean(loads) == pytest.approx(payload, abs=0.5)


def reduction_after(
    ticks: int, v_foot: Array, before: float = 0.0, mu: float | None = None, **fields: Any
) -> float:
    """What is taken off; `mu` is the friction coefficient that torques show, None if they do not.

    The foot is dragged along x, against a force along −x.
    """
    state, gains = blank(), gains_of(slip_speed=fields.pop("slip_speed", SPEED))
    state.contact = state.stance = TROT
    state.foot_force, state.v_foot, state.mu_reduction = SLIP_LOAD, v_foot, before
    if mu is not None:
        state.ground_force = [-60.0 * mu, 0.0, 60.0]
    for name, value in fields.items():
        setattr(state, name, value)
    for _ in range(ticks):
        update_mu_reduction(state, gains)
    return float(state.mu_reduction)


REST = np.zeros((4, 3))


def moving(leg: int, speed: float) -> Array:
    v_foot = REST.copy()
    v_foot[leg] = [0.6 * speed, -0.8 * speed, 0.0]
    return v_foot


@pytest.mark.parametrize("leg", [0, 3])
def test_a_foot_that_slides_takes_off_at_once_down_to_the_least(leg: int) -> None:
    assert reduction_after(10, moving(leg, 1.01 * SPEED)) == pytest.approx(0.15)
    assert reduction_after(500, moving(leg, 1.01 * SPEED)) == pytest.approx(MU - MU_MIN)


@pytest.mark.parametrize(
    ("v_foot", "fields"),
    [
        (moving(0, 0.99 * SPEED), {}),
        (REST + np.array([0.0, 0.0, 1.0]), {}),
        (moving(1, 2.0), {}),  # in swing
        (moving(0, 2.0), {"contact": 0.0}),
        (moving(0, 2.0), {"progress": 0.1}),  # landing
        (moving(0, 2.0), {"slip_speed": 0.0}),  # the plain setting
        (moving(0, 2.0), {"foot_force": 0.99 * SLIP_LOAD}),
    ],
)
def test_other_feet_take_nothing_off(v_foot: Array, fields: dict[str, Any]) -> None:
    assert reduction_after(100, v_foot, **fields) == 0.0


@pytest.mark.parametrize(("before", "slower"), [(0.25, 1.0), (MU - 0.2, 0.1)])
def test_friction_comes_back_slowly_and_on_slippery_ground_ten_times_as_slowly(
    before: float, slower: float
) -> None:
    assert reduction_after(50, REST, before) == pytest.approx(before - slower * 0.05 * MU_RECOVERY)
    assert reduction_after(5000, REST, before) == 0.0


@pytest.mark.parametrize(("mu", "counted_on"), [(0.8, MU_MIN), (0.2, 0.2), (0.05, 0.12)])
def test_friction_below_the_least_counts_where_forces_of_sliding_feet_show_it(
    mu: float, counted_on: float
) -> None:
    assert reduction_after(500, moving(0, 2.0), mu=mu) == pytest.approx(MU - counted_on)
    assert reduction_after(10, REST, 0.1, mu=mu) == pytest.approx(0.1 - 0.01 * MU_RECOVERY)
