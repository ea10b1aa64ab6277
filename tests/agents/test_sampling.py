"""From ticks to samples: means of forces, outputs in the yaw frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agents.sampling import measured, no_force, outputs_of
from tests.agents.controller.poses import random_pose, standing_pose


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
    other = replace(estimate, R=Z @ estimate.R, velocity=Z @ estimate.velocity)
    np.testing.assert_allclose(outputs_of(other, 0.0), outputs_of(estimate, 0.0), atol=1e-12)


def test_a_sample_is_the_mean_of_its_ticks() -> None:
    random = np.random.default_rng(1)
    ticks = random.normal(size=(10, 12))
    forces = no_force()
    for force in ticks:
        forces = forces.add(force)
    y = outputs_of(standing_pose().estimate, 0.0)
    sample = measured(420, forces, y, np.ones(4))
    np.testing.assert_allclose(sample.u, ticks.mean(axis=0), atol=1e-12)
    assert (sample.tick, sample.stamp_ns) == (420, 420_000_000)
    assert sample.y is y


def test_a_mean_over_nothing_is_no_force() -> None:
    np.testing.assert_array_equal(no_force().mean(), np.zeros(12))


def test_adding_a_tick_leaves_the_mean_so_far_alone() -> None:
    first = no_force().add(np.ones(12))
    first.add(np.full(12, 5.0))
    assert first.mean() == pytest.approx(np.ones(12))
