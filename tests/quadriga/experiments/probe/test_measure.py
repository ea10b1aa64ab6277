"""What is measured is what a walk of its own with the pulse would show."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from quadriga.experiments.probe.measure import PulsedWalk, join_robots, measure_robot, probed_config
from quadriga.experiments.probe.pulses import DIRECTIONS, FORCE, pulse_forces, pulse_starts
from quadriga.experiments.probe.responses import average
from quadriga.shared.config.load import load

pytestmark = pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")

# Two phases, and as short a horizon as goes with them.
SHORT: dict[str, Any] = {
    "gait.stand_ms": 100, "reference.ramp": 0.2, "planner.N": 21, "planner.applied": 20,
    "world.seed": 50900,
}  # fmt: skip


@pytest.mark.parametrize(
    "keys",
    [
        {"team.robots": 2},
        {"team.robots": 1, "world.terrain": "pebbles", "world.terrain_height": 0.02},
        {"team.robots": 2, "planner.interface": "force", "world.push": "r1:60:90:2.0:0.2"},
    ],
)
def test_a_branch_is_equal_to_a_walk_of_its_own_and_changes_nothing(keys: dict[str, Any]) -> None:
    config = probed_config(load(None, SHORT | keys), 50900)
    first, second = pulse_starts(config).tolist()
    force = pulse_forces(config, 0, first)[1]
    walk = PulsedWalk(config)
    walk.walk_to(first)
    branch = walk.horizon_with_pulse(0, first, force)
    without = walk.horizon_after(first)

    paired = PulsedWalk(config)
    paired.give_pulse(0, first, force)
    np.testing.assert_array_equal(branch, paired.horizon_after(first))
    undisturbed = PulsedWalk(config)
    np.testing.assert_array_equal(walk.horizon_after(second), undisturbed.horizon_after(second))
    np.testing.assert_array_equal(without, undisturbed.horizon_after(first))
    assert np.abs(branch - without)[:, 0, 14].max() > 5e-4, "the pulse to the left moves it"


def test_a_response_is_that_of_the_pulse_in_all_its_parts() -> None:
    config = load(None, SHORT | {"team.robots": 2})
    parts = [measure_robot(config, 50900, robot) for robot in (0, 1)]
    measured = join_robots(parts)
    P, D = len(measured.ticks), len(DIRECTIONS)
    assert measured.u.shape == (P, 2, D, 21, 12)
    assert measured.y.shape == (P, 2, D, 21, 2, 6)
    np.testing.assert_array_equal(measured.u[:, :, :, 2:], 0.0)
    for p, tick in enumerate(measured.ticks.tolist()):
        for robot in (0, 1):
            force = pulse_forces(config, robot, tick)
            for sample in (0, 1):
                np.testing.assert_allclose(measured.u[p, robot, :, sample], force, atol=1e-12)
    up = measured.y[:, [0, 1], 2, :, [0, 1], 0]
    assert up.max() > 5e-4, "a force upwards lifts the robot that has it"
    # Momentum: 20 ms of twice 20 N on 12 kg, before the low level answers.
    speed = measured.y[:, [0, 1], 0, 1, [0, 1], 1]
    mass = config.robot.mass
    np.testing.assert_allclose(speed, 2 * FORCE * 0.02 / mass, rtol=0.5)


def test_robots_without_yokes_do_not_move_each_other() -> None:
    config = load(None, SHORT | {"team.robots": 2, "team.yokes": "none"})
    measured = measure_robot(config, 50900, 0)
    np.testing.assert_array_equal(measured.y[..., 1, :], 0.0)
    assert np.abs(measured.y[..., 0, :]).max() > 0.0


def test_pulses_of_odd_seeds_are_negative_and_stored_as_positive_ones() -> None:
    config = load(None, SHORT | {"team.robots": 1})
    even, odd = (measure_robot(config, seed, 0) for seed in (50900, 50901))
    np.testing.assert_allclose(odd.u, even.u, atol=1e-12)
    assert np.linalg.norm(odd.y - even.y) < 0.3 * np.linalg.norm(even.y)


def test_a_late_fall_leaves_what_was_measured_before() -> None:
    keys = SHORT | {"team.robots": 1, "gait.stance_ms": 300}
    config = probed_config(load(None, keys), 50900)
    first, *_, last = pulse_starts(config).tolist()
    early = PulsedWalk(config).horizon_after(first)
    push = f"r1:2000:90:{(last + 10) / 1000}:0.3"
    pushed = PulsedWalk(probed_config(load(None, keys | {"world.push": push}), 50900))
    assert np.isnan(pushed.horizon_after(last)).all()
    np.testing.assert_array_equal(pushed.horizon_after(first), early)


def test_a_walk_that_ends_in_a_fall_measures_nothing() -> None:
    config = load(None, SHORT | {"team.robots": 1, "world.push": "r1:2000:90:0.5:0.3"})
    measured = measure_robot(config, 50900, 0)
    assert np.isnan(measured.y).all()
    assert average([measured]) is None
