"""When an agent stops, and what holds meanwhile: each failure has its fallback."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quadriga.agents.controller import controller
from quadriga.agents.controller.whole_body.limited import LIMITED
from quadriga.agents.controller.whole_body.problem import WholeBodySolution
from quadriga.agents.telemetry import Telemetry
from quadriga.shared.robot.conventions import Array
from quadriga.shared.wire.codec import decode, encode
from quadriga.shared.wire.messages import EStop, State, Status
from tests.a1 import standing
from tests.agents.duet import CONFIG, FIRST_PLAN, over_the_bus
from tests.agents.lone_robot import ALONE, Robot, is_damping, tilted


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
    assert robot.step(tilted(400, 1.2)).mode == "damping"
    outputs = robot.step(tilted(401, 1.2), estop=EStop(401, 401, "operator"))
    assert (outputs.mode, outputs.reason) == ("estop", "estop:operator")
    outputs = robot.step(tilted(402, 1.2))
    assert (outputs.mode, outputs.reason) == ("estop", "estop:operator")


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_tilt_beyond_the_limit_is_a_fall(sign: float) -> None:
    robot, limit = Robot(), ALONE.controller.fall_tilt
    robot.run(400)
    assert robot.step(tilted(400, sign * (limit - 0.01))).mode == "walk"
    outputs = robot.step(tilted(401, sign * (limit + 0.01)))
    for _ in range(20):  # also once it is upright again
        assert is_damping(outputs)
        assert (outputs.mode, outputs.reason) == ("damping", "fall")
        outputs = robot.step()


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_robot_that_points_straight_up_or_down_has_fallen(sign: float) -> None:
    robot = Robot()
    robot.run(400)
    quat = np.array([0.5, -0.5 * sign, 0.5 * sign, 0.5])
    outputs = robot.step(over_the_bus(replace(standing(400), imu_quat_wxyz=quat)))
    assert is_damping(outputs)
    assert (outputs.mode, outputs.reason) == ("damping", "fall")


def test_an_orientation_that_is_no_number_damps_the_joints_at_once() -> None:
    robot = Robot()
    robot.run(400)
    outputs = robot.step(replace(standing(400), imu_quat_wxyz=np.full(4, np.nan)))
    assert is_damping(outputs)
    assert (outputs.mode, outputs.reason) == ("damping", "no-estimate")


def fail(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_solution(_free: bool, row: Array, contact: Array) -> WholeBodySolution:
        return WholeBodySolution(np.zeros_like(row[LIMITED.x]), "infeasible:-1", contact)

    monkeypatch.setattr(controller, "finish", no_solution)


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
    assert (outputs.mode, outputs.reason) == ("damping", "qp-infeasible:-1")
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


@pytest.mark.parametrize("planner", ["", "none", "recursive"], ids=["bare", "plans", "adapts"])
@pytest.mark.parametrize(
    ("absurd", "sampled", "stays"),
    [
        # No foot is then known to stand, so that the filter makes no use of rates.
        (replace(standing(400), v_joint=np.full(12, 1e200)), False, False),
        (replace(standing(400), imu_gyro=np.full(3, 1e160)), True, False),
        # The velocity has them in it from then on.
        (replace(standing(400), imu_accel=np.full(3, 1e300)), True, True),
        (replace(standing(400), imu_accel=np.full(3, 1e170)), True, True),
    ],
    ids=["rates", "turning", "acceleration", "less acceleration"],
)
def test_finite_but_absurd_sensors_end_in_damping_or_pass_but_not_in_a_crash(
    absurd: State, sampled: bool, stays: bool, planner: str
) -> None:
    config = replace(ALONE, planner=replace(ALONE.planner, adaptation=planner or "none"))
    robot = Robot(config, planner=bool(planner))
    last = robot.run(400).command.tau
    outputs = robot.step(over_the_bus(absurd))
    np.testing.assert_array_equal(outputs.command.tau, last)
    if planner:
        assert outputs.plan is not None
        assert outputs.plan.status.startswith("nominal:") == sampled
        assert np.isfinite(outputs.plan.u).all()
        assert np.abs(outputs.plan.y).max() < 1.0
        not_learnt = outputs.counters.get("window_not_learnt", 0)
        assert not_learnt == (sampled and planner == "recursive")
    for _ in range(ALONE.controller.max_failures):
        outputs = robot.step()
        assert np.isfinite(outputs.command.tau).all()
    if stays:
        assert is_damping(outputs)
        assert outputs.reason == "qp-infeasible:singular"
    else:
        assert outputs.mode == "walk"
        assert outputs.counters["qp_failed"] == 1


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
