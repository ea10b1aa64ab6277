"""Torques that the whole-body QP may count on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quadriga.agents.controller.torque_bounds import torque_bounds
from quadriga.shared.robots.a1 import A1
from quadriga.shared.robots.torque_speed import motor_curves
from quadriga.sim_server.world.motors import Motors
from tests.sim_server.standing import IDEAL_MOTORS, command


def test_joints_that_stand_have_the_full_torque_both_ways() -> None:
    limits = motor_curves(A1, torque_speed=True)
    np.testing.assert_array_equal(torque_bounds(np.zeros(12), limits), A1.torque_bounds)


def test_motors_that_are_ideal_have_it_at_any_speed() -> None:
    limits = motor_curves(A1, torque_speed=False)
    np.testing.assert_array_equal(torque_bounds(np.full(12, 50.0), limits), A1.torque_bounds)


@pytest.mark.parametrize("rate", [-25.0, -14.0, -9.0, 3.0, 12.0, 17.0])
def test_bounds_are_what_the_worlds_motors_give_but_never_less_than_a_quarter(rate: float) -> None:
    bounds = torque_bounds(np.full(12, rate), motor_curves(A1, torque_speed=True))
    for row, tau in ((0, -99.0), (1, 99.0)):
        motors = Motors(A1, replace(IDEAL_MOTORS, torque_speed=True), 1, command())
        motors.drive(
            motors.send([command(tau=tau).row]),
            np.zeros((1, 19)),
            np.full((1, 18), rate),
            np.ones((1, 12)),
        )
        least = 0.25 * A1.torque_limit * np.sign(tau)
        expected = np.where(np.abs(motors.torque[0]) < np.abs(least), least, motors.torque[0])
        np.testing.assert_allclose(bounds[row], expected)
