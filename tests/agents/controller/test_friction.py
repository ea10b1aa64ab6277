"""Friction that is counted on: less while feet slide, slowly more again."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.agents.controller.friction import FrictionRule, update_mu_reduction
from quadriga.agents.controller.schedule import GaitPhase
from quadriga.agents.controller.sensed import FeetState
from quadriga.shared.robots.conventions import Array

CONTACT, STANCE = np.array([1.0, 0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0, 1.0])
MU, LEAST, SLIPPERY, SPEED, LOAD, RECOVERY, DT = 0.6, 0.25, 0.12, 0.25, 20.0, 0.02, 1e-3


def after(
    ticks: int,
    v_foot: Array,
    before: float = 0.0,
    progress: float = 0.5,
    speed: float = SPEED,
    contact: Array = CONTACT,
    force: float = LOAD,
    felt: float | None = None,
) -> float:
    """What is taken off; `felt` is the friction coefficient that torques show, None if they do not.

    The foot is dragged along x, against a force along −x.
    """
    ground_force = np.zeros((4, 3))
    if felt is not None:
        ground_force[:] = [-60.0 * felt, 0.0, 60.0]
    feet = FeetState(np.zeros((4, 3)), v_foot, np.full(4, force), ground_force)
    phase = GaitPhase(STANCE, progress, False)
    rule = FrictionRule(speed, LOAD, MU, LEAST, SLIPPERY, RECOVERY)
    for _ in range(ticks):
        before = update_mu_reduction(before, contact, phase, feet, rule, DT)
    return before


def moving(leg: int, speed: float) -> Array:
    v_foot = np.zeros((4, 3))
    v_foot[leg] = [0.6 * speed, -0.8 * speed, 0.0]
    return v_foot


def test_feet_that_stand_or_roll_take_nothing_off() -> None:
    assert after(100, moving(0, 0.99 * SPEED)) == 0.0
    rising = np.zeros((4, 3))
    rising[0, 2] = 1.0
    assert after(100, rising) == 0.0


@pytest.mark.parametrize("leg", [0, 3])
def test_a_foot_that_slides_takes_off_at_once_down_to_the_least(leg: int) -> None:
    assert after(10, moving(leg, 1.01 * SPEED)) == pytest.approx(0.15)
    assert after(500, moving(leg, 1.01 * SPEED)) == pytest.approx(MU - LEAST)


def test_friction_comes_back_slowly() -> None:
    assert after(1000, np.zeros((4, 3)), before=0.3) == pytest.approx(0.3 - RECOVERY)
    assert after(100_000, np.zeros((4, 3)), before=0.3) == 0.0


def test_swing_feet_landing_feet_and_the_plain_setting_do_not_count() -> None:
    assert after(100, moving(1, 2.0)) == 0.0
    assert after(100, moving(0, 2.0), contact=np.zeros(4)) == 0.0
    assert after(100, moving(0, 2.0), progress=0.1) == 0.0
    assert after(100, moving(0, 2.0), speed=0.0) == 0.0


def test_a_foot_that_hardly_bears_load_may_slide() -> None:
    assert after(100, moving(0, 2.0), force=0.99 * LOAD) == 0.0


@pytest.mark.parametrize(("felt", "counted_on"), [(0.8, LEAST), (0.2, 0.2), (0.05, SLIPPERY)])
def test_friction_below_the_least_is_believed_where_sliding_feet_feel_it(
    felt: float, counted_on: float
) -> None:
    assert after(500, moving(0, 2.0), felt=felt) == pytest.approx(MU - counted_on)


def test_a_foot_that_stands_shows_nothing_of_how_slippery_it_is() -> None:
    assert after(500, np.zeros((4, 3)), before=0.1, felt=0.05) == pytest.approx(
        0.1 - 0.5 * RECOVERY
    )


def test_slippery_ground_is_forgotten_ten_times_as_slowly_but_it_is_forgotten() -> None:
    believed = MU - 0.2
    assert after(1000, np.zeros((4, 3)), before=believed) == pytest.approx(
        believed - 0.1 * RECOVERY
    )
    assert after(200_000, np.zeros((4, 3)), before=believed) == 0.0


def test_a_slip_on_better_ground_does_not_raise_what_is_counted_on() -> None:
    assert after(100, moving(0, 2.0), before=MU - 0.15, felt=0.8) == pytest.approx(MU - 0.15)
