"""Outputs are those of the yaw frame."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.agents.controller.estimator import Estimate
from quadriga.agents.controller.sensing import outputs_at
from quadriga.shared.robots.conventions import Array
from tests.agents.controller.poses import random_pose


def outputs_of(estimate: Estimate, ground: float) -> Array:
    return outputs_at(estimate.position, estimate.velocity, estimate.R, estimate.omega, ground)


@given(st.integers(0, 2**31), st.floats(-3.0, 3.0))
@settings(deadline=None, max_examples=40)
def test_outputs_are_those_of_the_yaw_frame(seed: int, ground: float) -> None:
    estimate = random_pose(np.random.default_rng(seed), tilt=1.0).estimate
    roll, pitch, yaw = pin.rpy.matrixToRpy(estimate.R)
    velocity = pin.utils.rotate("z", yaw).T @ estimate.velocity
    wz = (estimate.R @ estimate.omega)[2]
    expected = [estimate.position[2] - ground, velocity[0], velocity[1], roll, pitch, wz]
    np.testing.assert_allclose(outputs_of(estimate, ground), expected, atol=1e-9)


def test_turning_the_world_does_not_change_the_outputs() -> None:
    estimate, Z = random_pose(np.random.default_rng(2)).estimate, pin.utils.rotate("z", 2.0)
    other = estimate._replace(R=Z @ estimate.R, velocity=Z @ estimate.velocity)
    np.testing.assert_allclose(outputs_of(other, 0.0), outputs_of(estimate, 0.0), atol=1e-12)
