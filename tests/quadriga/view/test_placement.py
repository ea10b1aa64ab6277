"""Dead reckoning against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quadriga.recordings.dead_reckoning import follow_speeds
from quadriga.shared.messages import Measurement
from quadriga.view.placement import LONGEST_MS, Placement, quat_of


def measurement(tick: int, vx: float, vy: float = 0.0, wz: float = 0.0) -> Measurement:
    y = np.array([0.26, vx, vy, 0.1, -0.2, wz])
    return Measurement(tick, 10**6 * tick, np.zeros(12), y, np.ones(4))


def walk(count: int, **speeds: float) -> Placement:
    place = Placement(0, 1.0, 2.0, 0.5)
    for k in range(1, count + 1):
        place = place.follow(measurement(10 * k, **speeds))
    return place


def test_a_robot_that_walks_straight_goes_along_its_heading() -> None:
    place = walk(100, vx=0.4, vy=0.3)
    forward, left = 0.4, 0.3
    assert place.x == pytest.approx(1.0 + forward * np.cos(0.5) - left * np.sin(0.5))
    assert place.y == pytest.approx(2.0 + forward * np.sin(0.5) + left * np.cos(0.5))
    assert (place.yaw, place.tick) == (0.5, 1000)


def test_a_robot_that_turns_goes_along_a_circle() -> None:
    radius, wz = 0.8, 0.5
    place = walk(300, vx=radius * wz, wz=wz)
    # The circle's centre is to the left of where it began.
    assert place.yaw == pytest.approx(0.5 + 1.5)
    assert place.x == pytest.approx(1.0 - radius * np.sin(0.5) + radius * np.sin(2.0))
    assert place.y == pytest.approx(2.0 + radius * np.cos(0.5) - radius * np.cos(2.0))


def test_the_steps_of_a_way_do_not_matter() -> None:
    row = np.array([[0.26, 0.5, -0.1, 0.0, 0.0, 0.7]])
    begin = np.array([0.3, -0.2, 1.0])
    at_once = follow_speeds(begin, row, 0.25)[-1]
    assert follow_speeds(begin, np.repeat(row, 25, axis=0))[-1] == pytest.approx(at_once)


def test_who_was_silent_for_long_is_where_it_was_heard_last() -> None:
    place = Placement(0, 1.0, 2.0, 0.5)
    assert place.follow(measurement(LONGEST_MS, vx=1.0)).x > 1.1
    later = place.follow(measurement(LONGEST_MS + 10, vx=1.0))
    assert (later.x, later.y, later.tick) == (1.0, 2.0, LONGEST_MS + 10)


def test_a_measurement_of_the_past_moves_nobody() -> None:
    place = Placement(500, 1.0, 2.0, 0.5)
    assert place.follow(measurement(500, vx=1.0)) is place


def test_attitudes_are_yaw_then_pitch_then_roll() -> None:
    roll, pitch, yaw = np.random.default_rng(1).uniform(-1.0, 1.0, (3, 8))
    expected = Rotation.from_euler("ZYX", np.stack([yaw, pitch, roll], axis=1))
    x, y, z, w = expected.as_quat().T
    assert quat_of(roll, pitch, yaw) == pytest.approx(np.stack([w, x, y, z], axis=1))
