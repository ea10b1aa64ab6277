"""Friction that is counted on: less while feet slide, slowly more again."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.agents.controller.friction import FrictionRule, update_mu_reduction
from quadriga.agents.controller.schedule import GaitPhase
from quadriga.agents.controller.sensed import FeetState
from quadriga.shared.robot.conventions import Array

CONTACT, STANCE = np.array([1.0, 0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0, 1.0])
MU, LEAST, SPEED, LOAD, RECOVERY, DT = 0.6, 0.25, 0.25, 20.0, 0.02, 1e-3


def after(
    ticks: int,
    v_foot: Array,
    before: float = 0.0,
    progress: float = 0.5,
    speed: float = SPEED,
    contact: Array = CONTACT,
    force: float = LOAD,
) -> float:
    feet = FeetState(np.zeros((4, 3)), v_foot, np.full(4, force))
    phase, rule = GaitPhase(STANCE, progress, False), FrictionRule(speed, LOAD, MU, LEAST, RECOVERY)
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
