"""When an agent stops, and what holds meanwhile: each failure has its fallback."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quadriga.agents.controller import controller
from quadriga.agents.controller.whole_body_qp import WholeBodySolution
from quadriga.agents.telemetry import Telemetry
from quadriga.agents.validate import AGREES_MS, HOLD_MS
from quadriga.shared.codec import decode, encode
from quadriga.shared.messages import Command, EStop, State, Status
from quadriga.shared.robots.conventions import GRAVITY, Array
from tests.a1 import standing
from tests.agents.duet import CONFIG, FIRST_PLAN, over_the_bus
from tests.agents.lone_robot import ALONE, Robot, is_damping, lean, tilted


@pytest.mark.parametrize("at", [100, 400])
def test_an_emergency_stop_damps_the_joints_for_good(at: int) -> None:
    robot = Robot()
    robot.run(at)
    outputs = robot.step(estop=EStop(at, at, "operator: key"))
    for _ in range(50):
        assert is_damping(outputs)
        assert (outputs.mode, outputs.reason) == ("estop", "estop:operator: key")
        outputs = robot.step(estop=EStop(at, at, "another"))


def test_a_status_can_be_read_whatever_the_reason_of_a_stop() -> None:
    robot = Robot()
    outputs = robot.step(estop=EStop(0, 0, 4096 * "x"))
    assert outputs.reason == "estop:" + 194 * "x"
    status = Telemetry("kalman").status(0, outputs, {})
    assert status is not None
    assert decode(encode(status), Status).reason == outputs.reason


def test_an_emergency_stop_outranks_a_fall() -> None:
    robot = Robot()
    robot.run(400)
    assert lean(robot, 1.2).mode == "passive"
    now = robot.tick
    outputs = robot.step(tilted(now, 1.2), estop=EStop(now, now, "operator"))
    assert (outputs.mode, outputs.reason) == ("estop", "estop:operator")
    outputs = robot.step(tilted(robot.tick, 1.2))
    assert (outputs.mode, outputs.reason) == ("estop", "estop:operator")


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_tilt_beyond_the_limit_is_a_fall(sign: float) -> None:
    robot, limit = Robot(), ALONE.controller.fall_tilt
    robot.run(400)
    below, beyond = sign * (limit - 0.06), sign * (limit + 0.06)  # the error of roll is estimated
    assert lean(robot, below).mode == "walk"
    outputs = lean(robot, beyond, begun=below)
    for _ in range(20):  # also once it is upright again
        assert is_damping(outputs)
        assert (outputs.mode, outputs.reason) == ("passive", "fall")
        outputs = robot.step()


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_robot_that_points_straight_up_or_down_has_fallen(sign: float) -> None:
    robot = Robot()
    robot.run(400)
    quat = np.array([0.5, -0.5 * sign, 0.5 * sign, 0.5])
    for _ in range(AGREES_MS):  # an attitude that jumps is not believed at once
        assert not is_damping(robot.step(over_the_bus(pointing(robot.tick, quat))))
    outputs = robot.step(over_the_bus(pointing(robot.tick, quat)))
    assert is_damping(outputs)
    assert (outputs.mode, outputs.reason) == ("passive", "fall")


def pointing(tick: int, quat: Array) -> State:
    """Its accelerometer measures what is along the vertical of this attitude."""
    w, x, y, z = quat
    up = np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
    return replace(standing(tick), imu_quat_wxyz=quat, imu_accel=GRAVITY * up)


@pytest.mark.parametrize("nothing", [0.0, np.nan])
def test_a_robot_without_an_attitude_stands_by_its_joints(nothing: float) -> None:
    robot = Robot()
    robot.run(400)
    modes, commands = list[tuple[str, str]](), list[Command]()
    for _ in range(1000):
        outputs = robot.step(replace(standing(robot.tick), imu_quat_wxyz=np.full(4, nothing)))
        if (outputs.mode, outputs.reason) not in modes:
            modes.append((outputs.mode, outputs.reason))
        if outputs.mode == "stand":
            commands.append(outputs.command)
    assert modes == [("walk", ""), ("stand", "imu-lost")]
    assert len(commands) == 1000 - HOLD_MS
    for command in commands:
        assert command.kp.all()
        assert command.kd.all()
        assert not command.tau.any()
    np.testing.assert_array_equal(commands[0].q_des, standing(0).q_joint)
    np.testing.assert_array_equal(commands[-1].q_des, ALONE.robot.q_stand)
    robot.step()
    outputs = robot.run(robot.tick + 2 * AGREES_MS)
    assert not outputs.command.kp.any()  # it knows its attitude again
    assert (outputs.mode, outputs.reason) == ("stand", "imu-lost")


def test_a_robot_without_the_encoder_of_a_knee_does_not_lead_that_knee() -> None:
    robot, knee = Robot(), 5
    robot.run(400)
    for _ in range(600):
        state = standing(robot.tick)
        state.row[State.CUTS["q_joint"].start + knee] = 0.0
        outputs = robot.step(state)
    assert (outputs.mode, outputs.reason) == ("stand", "encoder-lost:FR_calf")
    command, others = outputs.command, np.arange(12) != knee
    assert command.kp[knee] == command.kd[knee] == 0.0
    assert command.kp[others].all()
    np.testing.assert_array_equal(command.q_des[others], ALONE.robot.q_stand[others])
    # It bears a quarter of the weight: a foot behind the knee by link · sin(thigh + calf).
    geometry = ALONE.robot.geometry
    lever = -geometry.link * np.sin(ALONE.robot.q_stand[4] + ALONE.robot.q_stand[5])
    assert command.tau[knee] == pytest.approx(geometry.mass * GRAVITY / 4 * lever)
    assert not command.tau[others].any()
    robot.step()
    outputs = robot.run(robot.tick + 40)
    assert not outputs.command.kp.any()  # it knows the knee again


def test_who_stands_without_an_attitude_does_not_lead_a_knee_that_is_not_known() -> None:
    robot, knee = Robot(), 5
    robot.run(400)
    for _ in range(150):
        robot.step(replace(standing(robot.tick), imu_quat_wxyz=np.full(4, np.nan)))
    state = replace(standing(robot.tick), imu_quat_wxyz=np.full(4, np.nan))
    state.row[State.CUTS["q_joint"].start + knee] = 0.0
    outputs = robot.step(state)
    assert (outputs.mode, outputs.reason) == ("stand", "imu-lost")
    assert outputs.command.kp[knee] == outputs.command.kd[knee] == 0.0
    assert outputs.command.tau[knee] > 0.0
    assert np.count_nonzero(outputs.command.kp) == 11


def fail(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_solution(row: Array, _free: bool) -> WholeBodySolution:
        return WholeBodySolution(np.zeros_like(row), "infeasible:-1")

    monkeypatch.setattr(controller, "solve_qp", no_solution)


def test_without_a_solution_the_last_torques_hold_and_then_the_joints_are_damped(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    robot, limit = Robot(), ALONE.controller.max_failures
    last = robot.run(400).command.tau
    fail(monkeypatch)
    for failures in range(1, limit):
        outputs = robot.step()
        np.testing.assert_array_equal(outputs.command.tau, last)
        assert (outputs.command.kd == ALONE.controller.damping).all()
        assert (outputs.mode, outputs.counters["qp_failed"]) == ("walk", failures)
    outputs = robot.step()
    assert is_damping(outputs)
    assert (outputs.mode, outputs.reason) == ("passive", "qp-infeasible:-1")
    monkeypatch.undo()
    assert is_damping(robot.step())


def test_a_few_failures_are_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = Robot()
    robot.run(400)
    for _ in range(3):
        fail(monkeypatch)
        for _ in range(ALONE.controller.max_failures - 1):
            robot.step()
        monkeypatch.undo()
        outputs = robot.step()
    assert outputs.mode == "walk"
    assert not outputs.command.kd.any()


PLANNERS = pytest.mark.parametrize("planner", [False, True], ids=["bare", "plans"])


@PLANNERS
def test_finite_but_absurd_rates_of_joints_are_not_believed_and_no_crash(planner: bool) -> None:
    robot, twin = (Robot(ALONE, planner=planner) for _ in range(2))
    robot.run(400)
    twin.run(400)
    outputs = robot.step(over_the_bus(replace(standing(400), v_joint=np.full(12, 1e200))))
    # The joints are where they were, at rest, as those of a robot that is not told this.
    expected = twin.step(over_the_bus(standing(400))).command.tau
    np.testing.assert_array_equal(outputs.command.tau, expected)
    if planner:
        assert outputs.plan is not None
        assert not outputs.plan.status.startswith("nominal:")
        assert np.isfinite(outputs.plan.u).all()
        assert np.abs(outputs.plan.y).max() < 1.0
    for _ in range(ALONE.controller.max_failures):
        outputs = robot.step()
        assert np.isfinite(outputs.command.tau).all()
    assert outputs.mode == "walk"
    assert outputs.counters["encoder_invalid"] == 1 + AGREES_MS
    assert "qp_failed" not in outputs.counters


@PLANNERS
@pytest.mark.parametrize(
    "absurd",
    [
        replace(standing(400), imu_gyro=np.full(3, 1e160)),
        replace(standing(400), imu_accel=np.full(3, 1e300)),
        replace(standing(400), imu_accel=np.full(3, 1e170)),
    ],
    ids=["turning", "acceleration", "less acceleration"],
)
def test_a_finite_but_absurd_imu_is_invalid(absurd: State, planner: bool) -> None:
    robot = Robot(ALONE, planner=planner)
    last = robot.run(400).command.tau
    outputs = robot.step(over_the_bus(absurd))
    np.testing.assert_allclose(outputs.command.tau, last, atol=10.0)
    if planner:
        assert outputs.plan is not None
        assert not outputs.plan.status.startswith("nominal:")
    for _ in range(AGREES_MS + 5):
        outputs = robot.step()
    assert outputs.mode == "walk"
    assert "qp_failed" not in outputs.counters
    assert 1 <= outputs.counters["imu_invalid"] <= AGREES_MS + 1


def test_a_lost_reference_makes_the_robot_slow_down_and_stand() -> None:
    robot = Robot()
    robot.run(650)  # the last reference is of tick 600
    robot.references = False
    assert robot.run(1101).mode == "walk"
    outputs = robot.step()
    assert (outputs.mode, outputs.reason) == ("stopping", "reference-lost")
    assert outputs.ages_ms["reference"] == 501.0
    # Half a second later, at the next end of a stance: 300 + k · 200.
    assert robot.run(1700).mode == "stopping"
    outputs = robot.step()
    assert (outputs.mode, outputs.reason) == ("stand", "reference-lost")
    robot.references = True
    outputs = robot.run(2200)
    assert (outputs.mode, outputs.reason) == ("stand", "reference-lost")
    assert np.abs(outputs.command.tau).max() > 1.0  # it holds itself up


def test_a_peer_that_never_answers_makes_the_robot_stop() -> None:
    robot, planner = Robot(CONFIG, planner=True), CONFIG.planner
    lost = FIRST_PLAN + 40 * (planner.max_peer_age + planner.hold_steps + 1)
    assert robot.run(lost).mode == "walk"
    outputs = robot.step()
    assert (outputs.mode, outputs.reason) == ("stopping", "peer-lost:r2")
    assert outputs.plan is not None
    assert outputs.plan.status == "nominal:peer-lost"
    assert outputs.counters["plan_nominal"] == 1
    assert robot.run(lost + 701).mode == "stand"
    assert robot.step().plan is None
