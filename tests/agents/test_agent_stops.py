"""When an agent stops, and what holds meanwhile: each failure has its fallback."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

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


def test_an_emergency_stop_outranks_a_fall_and_a_status_can_hold_whatever_its_reason() -> None:
    robot = Robot()
    robot.run(400)
    assert lean(robot, 1.2).mode == "passive"
    outputs = robot.step(tilted(robot.tick, 1.2), estop=EStop(robot.tick, 0, 4096 * "x"))
    for _ in range(2):
        assert (outputs.mode, outputs.reason) == ("estop", "estop:" + 194 * "x")
        outputs = robot.step(tilted(robot.tick, 1.2))
    status = Telemetry("kalman").status(0, outputs, {})
    assert status is not None
    assert decode(encode(status), Status).reason == outputs.reason


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


KNEE = 5


def without(state: State, *, attitude: bool = True) -> State:
    """A state without the angle of a knee, or without any attitude, too."""
    row = state.row.copy()
    row[State.CUTS["q_joint"].start + KNEE] = 0.0
    if not attitude:
        row[State.CUTS["imu_quat_wxyz"]] = np.nan
    return State.from_row(state.tick, state.stamp_ns, row)


def test_a_robot_without_the_encoder_of_a_knee_does_not_lead_that_knee() -> None:
    robot, others = Robot(), np.arange(12) != KNEE
    robot.run(400)
    for _ in range(600):
        outputs = robot.step(without(standing(robot.tick)))
    assert (outputs.mode, outputs.reason) == ("stand", "encoder-lost:FR_calf")
    command = outputs.command
    assert command.kp[KNEE] == command.kd[KNEE] == 0.0
    assert command.kp[others].all()
    np.testing.assert_array_equal(command.q_des[others], ALONE.robot.q_stand[others])
    # It bears a quarter of the weight: a foot behind the knee by link · sin(thigh + calf).
    geometry = ALONE.robot.geometry
    lever = -geometry.link * np.sin(ALONE.robot.q_stand[4] + ALONE.robot.q_stand[5])
    assert command.tau[KNEE] == pytest.approx(geometry.mass * GRAVITY / 4 * lever)
    assert not command.tau[others].any()
    robot.step()
    outputs = robot.run(robot.tick + 40)
    assert not outputs.command.kp.any()  # it knows the knee again


def test_who_stands_without_an_attitude_does_not_lead_a_knee_that_is_not_known() -> None:
    robot = Robot()
    robot.run(400)
    for _ in range(150):
        robot.step(replace(standing(robot.tick), imu_quat_wxyz=np.full(4, np.nan)))
    outputs = robot.step(without(standing(robot.tick), attitude=False))
    assert (outputs.mode, outputs.reason) == ("stand", "imu-lost")
    assert outputs.command.kp[KNEE] == outputs.command.kd[KNEE] == 0.0
    assert outputs.command.tau[KNEE] > 0.0
    assert np.count_nonzero(outputs.command.kp) == 11


def fail(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_solution(row: Array, _free: bool) -> WholeBodySolution:
        return WholeBodySolution(np.zeros_like(row), "infeasible:-1")

    monkeypatch.setattr(controller, "solve_qp", no_solution)


def test_without_a_solution_the_last_torques_hold_and_then_the_joints_are_damped(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    robot, limit = Robot(), ALONE.controller.max_failures
    robot.run(400)
    for _ in range(3):  # a few failures are forgotten
        last = robot.step().command.tau
        fail(monkeypatch)
        before = robot.state.counters.get("qp_failed", 0)
        for failures in range(1, limit):
            outputs = robot.step()
            np.testing.assert_array_equal(outputs.command.tau, last)
            assert (outputs.command.kd == ALONE.controller.damping).all()
            assert (outputs.mode, outputs.counters["qp_failed"]) == ("walk", before + failures)
        monkeypatch.undo()
        assert not robot.step().command.kd.any()
    fail(monkeypatch)
    for _ in range(limit):
        outputs = robot.step()
    assert is_damping(outputs)
    assert (outputs.mode, outputs.reason) == ("passive", "qp-infeasible:-1")
    monkeypatch.undo()
    assert is_damping(robot.step())


PLANNERS = pytest.mark.parametrize("planner", [False, True], ids=["bare", "plans"])


@PLANNERS
@pytest.mark.parametrize(
    ("absurd", "counter", "most", "off"),
    [
        ({"v_joint": np.full(12, 1e200)}, "encoder_invalid", 1 + AGREES_MS, 0.0),
        ({"imu_gyro": np.full(3, 1e160)}, "imu_invalid", 1 + AGREES_MS, 10.0),
        ({"imu_accel": np.full(3, 1e300)}, "imu_invalid", 1 + AGREES_MS, 10.0),
        ({"imu_accel": np.full(3, 1e170)}, "imu_invalid", 1 + AGREES_MS, 10.0),
    ],
    ids=["rates", "turning", "acceleration", "less acceleration"],
)
def test_a_finite_but_absurd_reading_is_not_believed(
    absurd: dict[str, Any], counter: str, most: int, off: float, planner: bool
) -> None:
    robot, twin = (Robot(ALONE, planner=planner) for _ in range(2))
    last = robot.run(400).command.tau
    outputs = robot.step(over_the_bus(replace(standing(400), **absurd)))
    if not off:  # the joints are where they were, at rest, as those of one that is not told this
        twin.run(400)
        last = twin.step(over_the_bus(standing(400))).command.tau
    np.testing.assert_allclose(outputs.command.tau, last, rtol=0.0, atol=off)
    if planner:
        assert outputs.plan is not None
        assert not outputs.plan.status.startswith("nominal:")
        assert np.isfinite(outputs.plan.u).all()
        assert np.abs(outputs.plan.y).max() < 1.0
    for _ in range(max(ALONE.controller.max_failures, AGREES_MS + 5)):
        outputs = robot.step()
        assert np.isfinite(outputs.command.tau).all()
    assert outputs.mode == "walk"
    assert "qp_failed" not in outputs.counters
    counted = outputs.counters[counter]
    assert counted == most if counter == "encoder_invalid" else 1 <= counted <= most


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
