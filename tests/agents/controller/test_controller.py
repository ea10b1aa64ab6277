"""The controller's tick: what becomes of schedule, contacts and planned forces."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from agents.controller import whole_body_qp
from agents.controller.controller import Controller, ControllerState, Schedule, Task
from agents.controller.model import Terms
from agents.controller.swing import foothold, swing_reference
from agents.controller.whole_body_qp import Goal, Solution, Weights
from shared.config import Config
from shared.robot import GRAVITY, STAND_HEIGHT, TOTAL_MASS, Array
from tests.agents.controller.poses import FEET, MODEL, Pose, random_pose, standing_pose

STANDING = Schedule(np.ones(4), 0.5, -1)
TROT = np.array([1.0, 0.0, 0.0, 1.0])
REST = Task(np.zeros(2), 0.0, STAND_HEIGHT, np.zeros(12), feedforward=False)


def controller_of(**settings: Any) -> Controller:
    return Controller(replace(Config(), controller=replace(Config().controller, **settings)))


def step(
    controller: Controller, state: ControllerState, pose: Pose, schedule: Schedule,
    task: Task = REST, load: Array | None = None,
) -> tuple[ControllerState, Solution]:  # fmt: skip
    estimate = replace(pose.estimate, foot_force=np.full(4, 30.0) if load is None else load)
    return controller.step(state, estimate, pose.quat_wxyz, schedule, task, 1e-3)


@pytest.fixture
def goals(monkeypatch: pytest.MonkeyPatch) -> list[Goal]:
    """What the controller asks of its QP, tick by tick; the QP is solved all the same."""
    asked: list[Goal] = []
    real = whole_body_qp.solve_goal

    def listen(terms: Terms, R: Array, p_foot: Array, goal: Goal, weights: Weights) -> Solution:
        asked.append(goal)
        return real(terms, R, p_foot, goal, weights)

    monkeypatch.setattr(whole_body_qp, "solve_goal", listen)
    return asked


def test_a_standing_robot_carries_its_weight() -> None:
    controller, pose = controller_of(), standing_pose(0.4)
    state = controller.initial(pose.estimate, 0.4)
    for _ in range(10):
        state, solution = step(controller, state, pose, STANDING)
    assert solution.status == "unconstrained"
    np.testing.assert_allclose(
        solution.force.sum(axis=0), [0.0, 0.0, TOTAL_MASS * GRAVITY], atol=0.5
    )
    np.testing.assert_array_equal(state.contact.contact, np.ones(4))


def test_a_stance_foot_that_lost_contact_is_lowered_at_the_descent_speed(
    goals: list[Goal],
) -> None:
    controller, pose = controller_of(), standing_pose()
    config = Config().controller
    state = controller.initial(pose.estimate, 0.0)
    walking, load = Schedule(TROT, 0.3, 0), np.array([0.0, 0.0, 0.0, 30.0])
    for _ in range(config.lost_contact_ms - 1):
        state, _ = step(controller, state, pose, walking, load=load)
    assert state.contact.contact[0] == 1.0
    np.testing.assert_array_equal(state.foot_goal[0], pose.estimate.p_foot[0])
    for _ in range(22):
        before = state
        state, _ = step(controller, state, pose, walking, load=load)
    assert state.contact.contact[0] == 0.0
    descent = before.foot_goal[0] - state.foot_goal[0]
    np.testing.assert_allclose(descent, [0.0, 0.0, 1e-3 * config.descent_speed], atol=1e-12)
    sunk = pose.estimate.p_foot[0, 2] - state.foot_goal[0, 2]
    assert sunk == pytest.approx(21e-3 * config.descent_speed, abs=1.1e-3 * config.descent_speed)
    expected = -config.kp_swing * sunk - config.kd_swing * config.descent_speed
    np.testing.assert_allclose(goals[-1].swing[0], [0.0, 0.0, expected], atol=1e-9)
    state, _ = step(controller, state, pose, walking)  # it has found the ground
    assert state.contact.contact[0] == 1.0
    np.testing.assert_array_equal(state.foot_goal[0], pose.estimate.p_foot[0])


@pytest.mark.parametrize("seed", range(3))
def test_swing_feet_follow_their_reference(seed: int, goals: list[Goal]) -> None:
    """ẍ = ẍ_ref + Kp (x_ref − x) + Kd (ẋ_ref − ẋ), start at the switch, goal at the foothold."""
    random = np.random.default_rng(seed)
    controller, config = controller_of(), Config().controller
    before, pose = standing_pose(), random_pose(random)
    state = controller.initial(before.estimate, 0.0)
    load = 30.0 * TROT
    state, _ = step(controller, state, before, STANDING)
    state, _ = step(controller, state, before, Schedule(TROT, 0.0, 0), load=load)
    task = Task(np.array([0.4, 0.1]), 0.3, STAND_HEIGHT, np.zeros(12), feedforward=False)
    state, _ = step(controller, state, pose, Schedule(TROT, 0.4, 0), task, load)
    estimate, ground = pose.estimate, state.contact.ground
    yaw = np.arctan2(estimate.R[1, 0], estimate.R[0, 0])
    v_des = pin.utils.rotate("z", yaw) @ np.array([0.4, 0.1, 0.0])
    data = MODEL.createData()
    pin.forwardKinematics(MODEL, data, pose.q, pose.v)
    for leg in (1, 2):
        target = foothold(
            leg, estimate.position, estimate.velocity, estimate.R, v_des, 0.3, 0.6 * 0.2, 0.2,
            config.raibert_gain,
        )  # fmt: skip
        x, v, a = swing_reference(
            before.estimate.p_foot[leg], target, ground[[0, 3]].mean(),
            ground.max() + config.swing_height, 0.4, 0.2,
        )  # fmt: skip
        world = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        v_foot = pin.getFrameVelocity(MODEL, data, FEET[leg], world).linear
        expected = a + config.kp_swing * (x - estimate.p_foot[leg])
        expected += config.kd_swing * (v - v_foot)
        np.testing.assert_allclose(goals[-1].swing[leg], expected, atol=1e-8)
    assert not goals[-1].swing[[0, 3]].any()


def test_planned_deviations_are_asked_of_the_stance_feet_in_the_yaw_frame() -> None:
    """With hardly any weight on anything else the forces are those desired."""
    yaw, pose = 0.9, standing_pose(0.9)
    controller = controller_of(gamma_tau=1e-6, gamma_defect=1.0, gamma_force=1e6)
    deviation = np.arange(12.0)
    task = replace(REST, deviation=deviation)
    state = controller.initial(pose.estimate, yaw)
    _, solution = step(controller, state, pose, STANDING, task)
    expected = deviation.reshape(4, 3) @ pin.utils.rotate("z", yaw).T
    expected[:, 2] += TOTAL_MASS * GRAVITY / 4
    np.testing.assert_allclose(solution.force, expected, atol=0.02)


def test_the_plain_setting_trusts_the_schedule_and_not_the_feet() -> None:
    controller, pose = controller_of(contact_detection=False), standing_pose()
    state = controller.initial(pose.estimate, 0.0)
    for _ in range(20):
        state, solution = step(controller, state, pose, Schedule(TROT, 0.3, 0), load=np.zeros(4))
    np.testing.assert_array_equal(state.contact.contact, TROT)
    assert solution.force[0, 2] > 40.0


def test_the_state_handed_in_is_left_as_it_was() -> None:
    controller, pose = controller_of(), random_pose(np.random.default_rng(3))
    state = controller.initial(pose.estimate, 0.0)
    arrays = (state.swing_start, state.foot_goal, state.contact.ground, state.integrators.speed)
    copies = [array.copy() for array in arrays]
    first = step(controller, state, pose, Schedule(TROT, 0.3, 0))[1]
    second = step(controller, state, pose, Schedule(TROT, 0.3, 0))[1]
    assert first.tau.tobytes() == second.tau.tobytes()
    for array, copy in zip(arrays, copies, strict=True):
        np.testing.assert_array_equal(array, copy)
