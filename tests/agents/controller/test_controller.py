"""The controller's tick: what becomes of schedule, contacts and planned forces."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from quadriga.agents.controller.controller import Controller, ControllerOutputs, Task
from quadriga.agents.controller.estimator import filter_noise, foot_trust
from quadriga.agents.controller.memory import Memory
from quadriga.agents.controller.schedule import Schedule
from quadriga.agents.controller.swing import (
    MotionReference,
    foothold,
    limit_inwards,
    swing_reference,
)
from quadriga.agents.controller.trunk_feedback import trunk_gains
from quadriga.agents.controller.whole_body.solution import solve_goal
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.a1 import A1
from quadriga.shared.robots.conventions import GRAVITY, Array
from tests.a1 import STAND_HEIGHT, TOTAL_MASS, nominal_forces, standing, standing_filter
from tests.agents.controller.parts import (
    estimate_trunk,
    initial_contact,
    initial_integrators,
    step_contact,
    trunk_acceleration,
)
from tests.agents.controller.poses import FEET, MODEL, Pose, loaded_with, random_pose, standing_pose

REST_INTEGRATORS = initial_integrators(0.0)
STANDING = Schedule(np.ones(4), 0.5, -1)
TROT = np.array([1.0, 0.0, 0.0, 1.0])
REST = Task(0.0, 0.0, 0.0, STAND_HEIGHT, np.zeros(12), feedforward=False)


def controller_of(**settings: Any) -> Controller:
    return Controller(replace(Config(), controller=replace(Config().controller, **settings)))


def step(
    controller: Controller,
    memory: Memory | None,
    pose: Pose,
    schedule: Schedule,
    task: Task = REST,
    load: Array | None = None,
) -> ControllerOutputs:
    """One tick of a robot that knows its pose."""
    bears = loaded_with(np.full(4, 30.0) if load is None else load)
    estimate = pose.estimate._replace(foot_load=bears)
    sensed = controller.place(memory, estimate, schedule, 1e-3)
    return controller.act(sensed, schedule, task, 1e-3)


def test_a_standing_robot_carries_its_weight() -> None:
    controller, pose = controller_of(), standing_pose(0.4)
    memory = None
    for _ in range(10):
        outputs = step(controller, memory, pose, STANDING)
        memory = outputs.memory
    assert outputs.solution.status == "unconstrained"
    np.testing.assert_allclose(
        outputs.solution.force.sum(axis=0), [0.0, 0.0, TOTAL_MASS * GRAVITY], atol=0.5
    )
    np.testing.assert_array_equal(outputs.memory.contact, np.ones(4))
    assert outputs.memory.yaw_des == pytest.approx(0.4)


def test_a_stance_foot_that_lost_contact_is_lowered_at_the_descent_speed() -> None:
    controller, pose = controller_of(), standing_pose()
    config = Config().controller
    memory = step(controller, None, pose, STANDING).memory
    walking, load = Schedule(TROT, 0.3, 0), np.array([0.0, 0.0, 0.0, 30.0])
    for _ in range(config.lost_contact_ms - 1):
        memory = step(controller, memory, pose, walking, load=load).memory
    assert memory.contact[0] == 1.0
    np.testing.assert_array_equal(memory.foot_goal[0], pose.estimate.p_foot[0])
    for _ in range(22):
        before = memory
        outputs = step(controller, memory, pose, walking, load=load)
        memory = outputs.memory
    assert memory.contact[0] == 0.0
    descent = before.foot_goal[0] - memory.foot_goal[0]
    np.testing.assert_allclose(descent, [0.0, 0.0, 1e-3 * config.descent_speed], atol=1e-12)
    sunk = pose.estimate.p_foot[0, 2] - memory.foot_goal[0, 2]
    assert sunk == pytest.approx(21e-3 * config.descent_speed, abs=1.1e-3 * config.descent_speed)
    expected = -config.kp_swing * sunk - config.kd_swing * config.descent_speed
    np.testing.assert_allclose(outputs.goal.swing[0], [0.0, 0.0, expected], atol=1e-9)
    memory = step(controller, memory, pose, walking).memory  # it has found the ground
    assert memory.contact[0] == 1.0
    np.testing.assert_array_equal(memory.foot_goal[0], pose.estimate.p_foot[0])


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("borne", [30.0, 90.0])
def test_swing_feet_follow_their_reference(seed: int, borne: float) -> None:
    """ẍ = ẍ_ref + Kp (x_ref − x) + Kd (ẋ_ref − ẋ), start at the switch, goal at the foothold."""
    random = np.random.default_rng(seed)
    controller, config = controller_of(), Config().controller
    before, pose = standing_pose(), random_pose(random)
    load = borne * TROT
    memory = step(controller, None, before, STANDING).memory
    memory = step(controller, memory, before, Schedule(TROT, 0.0, 0), load=load).memory
    assert (memory.load > 0.0) == (2.0 * borne > GRAVITY * TOTAL_MASS)
    task = Task(0.4, 0.1, 0.3, STAND_HEIGHT, np.zeros(12), feedforward=False)
    outputs = step(controller, memory, pose, Schedule(TROT, 0.4, 0), task, load)
    estimate, ground = pose.estimate, outputs.memory.ground
    yaw = np.arctan2(estimate.R[1, 0], estimate.R[0, 0])
    v_des = pin.utils.rotate("z", yaw) @ np.array([0.4, 0.1, 0.0])
    velocity = estimate.velocity
    data = MODEL.createData()
    pin.forwardKinematics(MODEL, data, pose.q, pose.v)
    for leg in (1, 2):
        x, y = A1.feet_under_hips[leg]
        target = foothold(
            (float(x), float(y)),
            estimate.position,
            estimate.R,
            MotionReference(velocity, v_des, 0.3, config.foothold_inwards),
            0.6 * 0.2,
            0.2,
            config.raibert_gain,
        )
        inwards = config.foothold_inwards * (1.0 + outputs.memory.load / TOTAL_MASS)
        limit_inwards(target, float(y), estimate.position, estimate.R, inwards)
        x, v, a = swing_reference(
            before.estimate.p_foot[leg],
            target,
            ground[[0, 3]].mean() + A1.geometry.foot_radius,
            ground.max() + config.swing_height,
            0.4,
            0.2,
            config.swing_delay,
        )
        world = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        v_foot = pin.getFrameVelocity(MODEL, data, FEET[leg], world).linear
        expected = a + config.kp_swing * (x - estimate.p_foot[leg])
        expected += config.kd_swing * (v - v_foot)
        np.testing.assert_allclose(outputs.goal.swing[leg], expected, atol=1e-8)
    assert not outputs.goal.swing[[0, 3]].any()


def hanging(controller: Controller, pose: Pose, ticks: int = 30) -> ControllerOutputs:
    """A robot whose scheduled stance feet find nothing to stand on."""
    memory = step(controller, None, standing_pose(), STANDING).memory
    for _ in range(ticks):
        outputs = step(controller, memory, pose, Schedule(TROT, 0.3, 0), load=np.zeros(4))
        memory = outputs.memory
    return outputs


def test_a_robot_in_the_air_falls_and_reaches_for_the_ground() -> None:
    """As fast as it sinks and no farther than its legs are long."""
    config, pose = Config().controller, standing_pose()
    pose.estimate.velocity[2] = pose.v[2] = -1.0
    outputs = hanging(controller_of(), pose)
    assert not outputs.memory.contact.any()
    np.testing.assert_array_equal(outputs.goal.trunk, [0.0, 0.0, -GRAVITY, 0.0, 0.0, 0.0])
    before = hanging(controller_of(), pose, ticks=29).memory
    descent = (before.foot_goal - outputs.memory.foot_goal)[[0, 3], 2]
    np.testing.assert_allclose(descent, 1e-3 * (config.descent_speed + 1.0), atol=1e-12)
    lowest = hanging(controller_of(), pose, ticks=500).memory.foot_goal[[0, 3], 2]
    assert (lowest > pose.estimate.position[2] - 0.4).all()


def test_a_foot_in_its_reflex_rises_and_moves_away_from_what_stopped_it() -> None:
    """Then its swing begins anew from where it is."""
    controller, config, pose = controller_of(), Config().controller, standing_pose()
    load = 30.0 * TROT
    memory = step(controller, None, pose, STANDING).memory
    memory = step(controller, memory, pose, Schedule(TROT, 0.0, 0), load=load).memory
    task = replace(REST, vx=0.5)  # the foot stays where it is: something holds it
    for tick in range(1, 80):
        memory = step(controller, memory, pose, Schedule(TROT, tick / 200, 0), task, load).memory
    memory.reaction[1] = [-60.0, 0.0, 10.0]
    outputs = step(
        controller, memory, pose, Schedule(TROT, 0.4, 0), task, np.array([30.0, 30.0, 0.0, 30.0])
    )
    assert outputs.memory.contact[1] == 0.0
    assert outputs.memory.reflex[1] == pytest.approx(1e-3 * config.reflex_ms)
    away = config.kd_swing * config.reflex_lift
    np.testing.assert_allclose(outputs.goal.swing[1], [-0.3 * away, 0.0, away], atol=1e-9)
    for tick in range(81, 100):
        memory = outputs.memory
        outputs = step(controller, memory, pose, Schedule(TROT, tick / 200, 0), task, load)
        if outputs.memory.lift[1] > 0.0:
            break
    assert outputs.memory.lift[1] == tick / 200
    np.testing.assert_array_equal(outputs.memory.swing_start[1], pose.estimate.p_foot[1])


def test_planned_deviations_are_asked_of_the_stance_feet_in_the_yaw_frame() -> None:
    """With hardly any weight on anything else the forces are those desired."""
    yaw, pose = 0.9, standing_pose(0.9)
    controller = controller_of(gamma_tau=1e-6, gamma_defect=1.0, gamma_force=1e6)
    deviation = np.arange(12.0)
    task = replace(REST, deviation=deviation)
    solution = step(controller, None, pose, STANDING, task).solution
    expected = deviation.reshape(4, 3) @ pin.utils.rotate("z", yaw).T
    expected[:, 2] += TOTAL_MASS * GRAVITY / 4
    np.testing.assert_allclose(solution.force, expected, atol=0.02)


def test_nothing_is_asked_of_legs_scheduled_to_swing() -> None:
    controller, pose = controller_of(), standing_pose()
    walking, load = Schedule(TROT, 0.3, 0), 30.0 * TROT
    swing = np.repeat(1.0 - TROT, 3)
    plain = step(controller, None, pose, walking, replace(REST, feedforward=True), load)
    task = replace(REST, deviation=50.0 * swing, feedforward=True)
    outputs = step(controller, None, pose, walking, task, load)
    assert outputs.solution.tau.tobytes() == plain.solution.tau.tobytes()


def test_a_sample_of_forces_is_their_mean_over_its_ticks() -> None:
    """Nominal weight on the scheduled feet plus the deviation, from the tick it begins with."""
    controller, pose, random = controller_of(), standing_pose(), np.random.default_rng(1)
    walking, memory, applied = Schedule(TROT, 0.3, 0), None, []
    for tick in range(25):
        task = replace(REST, deviation=random.normal(size=12))
        estimate = pose.estimate._replace(foot_load=loaded_with(30.0 * TROT))
        sensed = controller.place(memory, estimate, walking, 1e-3)
        memory = controller.act(sensed, walking, task, 1e-3, new_sample=tick == 15).memory
        applied.append(nominal_forces(TROT > 0.5) + task.deviation * np.repeat(TROT, 3))
        first = 15 if tick >= 15 else 0
        np.testing.assert_allclose(memory.mean_force, np.mean(applied[first:], axis=0), atol=1e-12)


def test_the_plain_setting_trusts_the_schedule_and_not_the_feet() -> None:
    controller, pose = controller_of(contact_detection=False), standing_pose()
    memory = None
    for _ in range(20):
        outputs = step(controller, memory, pose, Schedule(TROT, 0.3, 0), load=np.zeros(4))
        memory = outputs.memory
    np.testing.assert_array_equal(outputs.memory.contact, TROT)
    assert outputs.solution.force[0, 2] > 40.0


def test_the_memory_handed_in_is_left_as_it_was() -> None:
    controller, pose = controller_of(), random_pose(np.random.default_rng(3))
    memory = step(controller, None, standing_pose(), STANDING).memory
    copy, walking = memory.flat.copy(), Schedule(TROT, 0.3, 0)
    sensed = controller.place(memory, pose.estimate, walking, 1e-3)
    placed = sensed.memory.flat.copy()
    first, second = (controller.act(sensed, walking, REST, 1e-3) for _ in range(2))
    assert first.solution.tau.tobytes() == second.solution.tau.tobytes()
    np.testing.assert_array_equal(memory.flat, copy)
    np.testing.assert_array_equal(sensed.memory.flat, placed)


def test_the_tick_in_one_piece_is_its_parts_one_by_one() -> None:
    """Estimator, contacts, references and QP on their own come to what the compiled tick does."""
    controller, config = controller_of(foot_load="sensor"), Config()
    noise, walking = filter_noise(config.estimator), Schedule(TROT, 0.3, 0)
    state, ramp = standing(0), config.estimator.trust_ramp
    task = Task(0.3, 0.1, 0.2, STAND_HEIGHT + 0.01, np.arange(12.0), feedforward=True)
    filtered, contacts, integrators = standing_filter(state), initial_contact(), REST_INTEGRATORS
    memory = None
    for _ in range(30):
        outputs = controller.act(
            controller.sense(memory, state, walking, 1e-3), walking, task, 1e-3
        )
        memory = outputs.memory
        trust = foot_trust(TROT, 0.3, state.foot_force, ramp, config.estimator.contact_force)
        filtered, estimate = estimate_trunk(filtered, state, trust, noise, 1e-3)
        contacts = step_contact(
            contacts, config.controller, walking, state.foot_force, estimate.p_foot[:, 2], 1e-3
        )
        integrators, trunk, _ = trunk_acceleration(
            integrators,
            trunk_gains(config),
            controller.body,
            estimate,
            replace(task, deviation=task.deviation * np.repeat(TROT, 3)),
            contacts.ground_height,
            TROT,
            1e-3,
        )
        q = np.concatenate([estimate.position, [0.0, 0.0, 0.0, 1.0], estimate.q_joint])
        v = np.concatenate([estimate.velocity, estimate.omega, estimate.v_joint])
        solution = solve_goal(
            controller.body.terms(q, v),
            estimate.R,
            estimate.p_foot,
            outputs.goal,
            controller.weights,
            A1.torque_bounds.copy(),
        )
    np.testing.assert_allclose(outputs.memory.mean, filtered.mean, atol=1e-12)
    np.testing.assert_allclose(outputs.memory.contact, contacts.feet.contact)
    np.testing.assert_allclose(outputs.memory.ground, contacts.feet.ground, atol=1e-12)
    np.testing.assert_allclose(outputs.memory.speed_integral, integrators.speed, atol=1e-12)
    np.testing.assert_allclose(outputs.memory.height_integral, integrators.height, atol=1e-12)
    np.testing.assert_allclose(outputs.goal.trunk, trunk, atol=1e-9)
    np.testing.assert_allclose(outputs.solution.tau, solution.tau, atol=1e-8)
    np.testing.assert_allclose(outputs.solution.force, solution.force, atol=1e-6)
    assert outputs.solution.status == solution.status
