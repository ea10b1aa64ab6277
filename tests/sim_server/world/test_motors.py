"""Motors and joints: what is left of a command on its way to the joints."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared.messages import Command
from quadriga.shared.robots.a1 import A1
from quadriga.shared.robots.conventions import N_JOINTS, Array
from quadriga.shared.robots.registry import ROBOTS
from quadriga.shared.robots.torque_speed import motor_curves, torque_range
from quadriga.sim_server.world.motors import Motors
from quadriga.sim_server.world.world import World
from tests.sim_server.standing import IDEAL_MOTORS, command, configured

SOUND = np.ones((1, N_JOINTS))
IDLE = command()


def motors(**changes: Any) -> Motors:
    """The motors of one A1, ideal but for `changes`."""
    return Motors(A1, replace(IDEAL_MOTORS, **changes), 1, IDLE)


def drive(of: Motors, asked: Command, q: float = 0.0, v: float = 0.0) -> Array:
    """Torques of the joints after a tick under a command, (12,), at equal angles and rates."""
    arrived = of.send(asked.row[None])
    of.drive(arrived, np.full((1, 19), q), np.full((1, 18), v), SOUND)
    left: Array = of.joint_torque[0].copy()
    return left


@pytest.mark.parametrize("delay", [0, 7])
def test_a_command_acts_as_late_as_the_delay_says(delay: int) -> None:
    of = motors(delay_ms=delay)
    given = [drive(of, command(tau=float(1 + tick)))[0] for tick in range(12)]
    assert given == [0.0] * delay + [1.0 + tick for tick in range(12 - delay)]


def test_torque_follows_as_a_first_order_lag() -> None:
    of = motors(bandwidth=50.0)
    beyond = motors(bandwidth=50.0)
    for _ in range(5):  # what is beyond the limit does not come sooner
        np.testing.assert_array_equal(
            drive(of, command(tau=33.5)), drive(beyond, command(tau=335.0))
        )
    of = motors(bandwidth=50.0)
    given = [drive(of, command(tau=10.0))[0] for _ in range(20)]
    expected = 10.0 * (1.0 - np.exp(-2.0 * math.pi * 50.0 * 1e-3 * np.arange(1, 21)))
    np.testing.assert_allclose(given, expected, rtol=1e-12)


@given(st.floats(-40.0, 40.0), st.floats(-60.0, 60.0), st.sampled_from(sorted(ROBOTS)))
def test_no_motor_drives_beyond_its_torque_speed_line(v: float, tau: float, kind: str) -> None:
    robot = ROBOTS[kind]
    of = Motors(robot, replace(IDEAL_MOTORS, torque_speed=True), 1, IDLE)
    given = drive(of, command(tau=tau), v=v)
    for k in range(3):
        ends = [robot.corner_speed[k], robot.speed[k]]
        line = np.interp(abs(v), ends, [robot.driving_torque[k], 0.0])
        limit = line if tau * v > 0.0 else robot.torque[k]
        assert given[k] == pytest.approx(math.copysign(min(abs(tau), limit), tau), abs=1e-9)


@pytest.mark.parametrize("k", [0, 11])
def test_the_go2_has_unitrees_curve(k: int) -> None:
    """Y1 20.2 N·m driving, Y2 23.4 braking, X1 13.5 and X2 30 rad/s; the knee has a gear more."""
    curves = motor_curves(ROBOTS["go2"], torque_speed=True)
    gear = 30.1 / 15.7 if k % 3 == 2 else 1.0
    for v in (0.0, 5.0, 13.49, 13.51, 20.0, 29.9, 30.1, 60.0):
        driving = 20.2 * min(1.0, max(0.0, (30.0 - v) / (30.0 - 13.5))) if v else 23.4
        for sign in (1.0, -1.0):
            bounds = np.array(torque_range(sign * v / gear, curves, k))
            expected = gear * np.array([-23.4, driving])
            np.testing.assert_allclose(sorted(sign * bounds), expected, rtol=2e-3, atol=0.01)


@given(st.floats(-30.0, 30.0))
def test_friction_only_ever_brakes_and_is_no_part_of_what_the_motor_feels(v: float) -> None:
    of = motors(friction=0.4, viscous_friction=0.04)
    taken = drive(of, command(tau=5.0), v=v) - 5.0
    np.testing.assert_array_equal(of.torque[0], 5.0)
    assert (taken * v <= 0.0).all()
    if abs(v) > 0.3:
        np.testing.assert_allclose(taken, -math.copysign(0.4, v) - 0.04 * v, atol=1e-4)


@pytest.mark.parametrize("share", [0.5, 0.85])
def test_a_motor_heats_up_to_the_square_of_its_share_of_continuous_torque(share: float) -> None:
    """A motor that is asked for more is left with its continuous torque."""
    hot = motors(heat_time=0.2)
    assert drive(hot, command(tau=33.5))[0] == 33.5
    for _ in range(5000):
        left = drive(hot, command(tau=33.5))[0]
    assert left == pytest.approx(A1.continuous_torque[0], rel=0.05)
    assert hot.heat.max() < 1.1
    of = motors(heat_time=0.5)
    tau = share * A1.continuous_torque[0]
    for _ in range(700):
        drive(of, command(tau=tau))
    expected = share**2 * (1.0 - math.exp(-700 / 500))
    np.testing.assert_allclose(of.heat, expected, rtol=2e-3)


def test_a_joint_that_is_thrown_against_its_stop_stays_within_its_range() -> None:
    """A soft stop gives way by more than a hard one, and the hard one by less than 0.02 rad."""
    beyond = {}
    for hard in (True, False):
        world = World(configured(1, motors=replace(IDEAL_MOTORS, hard_stops=hard)))
        world.physics.qpos[2], world.physics.qpos[9::3] = 1.0, A1.lower[2] + 0.05
        world.physics.qvel[8::3] = -12.0
        greatest = 0.0
        for _ in range(60):
            world.step({"r1": IDLE})
            greatest = max(greatest, float((A1.lower[2] - world.physics.qpos[9::3]).max()))
        beyond[hard] = greatest
    assert 0.0 < beyond[True] < 0.02 < beyond[False]


def test_heat_takes_nothing_from_the_torque_that_speed_leaves() -> None:
    """Heat limits the current and speed the voltage: of the two limits the lower one holds."""
    of = motors(torque_speed=True, heat_time=300.0)
    of.heat[:] = 1.2
    fast = A1.corner_speed[0] + 0.9 * (A1.speed[0] - A1.corner_speed[0])
    by_speed = torque_range(fast, motor_curves(A1, torque_speed=True), 0)[1]
    assert by_speed < A1.continuous_torque[0]
    assert drive(of, command(tau=40.0), v=fast)[0] == by_speed
    assert drive(of, command(tau=40.0))[0] == A1.continuous_torque[0]
