"""A tick as a whole: what becomes of schedule, contacts and planned forces."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from quadriga.agents.agent import Agent, Inputs
from quadriga.agents.controller.controller import control
from quadriga.agents.controller.trunk import TrunkCommand
from quadriga.agents.controller.whole_body_qp import WholeBodySolution
from quadriga.agents.estimator.estimator import estimate
from quadriga.agents.estimator.robot_state import RobotState, gains_row
from quadriga.agents.gait import STANDING
from quadriga.shared.config.sections import Config, GaitConfig, PlannerConfig, TeamConfig
from quadriga.shared.messages import Reference, State
from quadriga.shared.robots.conventions import GRAVITY, Array
from tests.a1 import STAND_HEIGHT, TOTAL_MASS, standing
from tests.agents.estimator.poses import DT

TROT = np.array([1.0, 0.0, 0.0, 1.0])
WALKING = np.array([*TROT, 0.3, 0.0])
REST = TrunkCommand(0.0, 0.0, 0.0, STAND_HEIGHT, np.zeros(12), feedforward=False)


class LowLevel:
    """Estimator and controller of a robot with these keys of the controller."""

    def __init__(self, **controller: Any) -> None:
        config = Config()
        config = replace(config, controller=replace(config.controller, **controller))
        self.gains = gains_row(config)
        self.state: RobotState | None = None

    def step(
        self,
        sensors: State | None = None,
        schedule: Array = STANDING,
        command: TrunkCommand = REST,
        truth: Array | None = None,
    ) -> WholeBodySolution:
        sensors = standing(0) if sensors is None else sensors
        known = estimate(self.state, sensors, schedule, DT, self.gains, truth)
        self.state, solution = control(known, command, self.gains)
        return solution


def known_at(yaw: float, load: Array) -> Array:
    """The row of the truth of a robot that stands still, whose feet bear a load each, N."""
    quat = [np.cos(0.5 * yaw), 0.0, 0.0, np.sin(0.5 * yaw)]
    return np.array([*quat, 0.0, 0.0, STAND_HEIGHT, *np.zeros(6), *load])


def test_a_standing_robot_carries_its_weight_and_keeps_its_heading() -> None:
    robot = LowLevel()
    for _ in range(10):
        solution = robot.step(truth=known_at(0.4, np.full(4, 30.0)))
    assert solution.status == "unconstrained"
    weight = [0.0, 0.0, TOTAL_MASS * GRAVITY]
    np.testing.assert_allclose(solution.force.sum(axis=0), weight, atol=0.5)
    assert robot.state is not None
    np.testing.assert_array_equal(robot.state.contact, np.ones(4))
    assert robot.state.yaw_des == pytest.approx(0.4)


def test_planned_deviations_are_asked_of_the_stance_feet_in_the_yaw_frame() -> None:
    """With hardly any weight on anything else the forces are those desired."""
    yaw, deviation = 0.9, np.arange(12.0)
    robot = LowLevel(gamma_tau=1e-6, gamma_defect=1.0, gamma_force=1e6, load_time=0.0)
    truth = known_at(yaw, np.full(4, 30.0))
    solution = robot.step(command=REST._replace(deviation=deviation), truth=truth)
    expected = deviation.reshape(4, 3) @ pin.utils.rotate("z", yaw).T
    expected[:, 2] += TOTAL_MASS * GRAVITY / 4
    np.testing.assert_allclose(solution.force, expected, atol=0.02)


def test_nothing_is_asked_of_legs_scheduled_to_swing() -> None:
    found = []
    for share in (0.0, 50.0):
        command = REST._replace(deviation=share * np.repeat(1.0 - TROT, 3), feedforward=True)
        solution = LowLevel().step(None, WALKING, command, known_at(0.0, 30.0 * TROT))
        found.append(solution.tau.tobytes())
    assert found[0] == found[1]


def test_a_robot_in_the_air_falls_and_the_plain_setting_trusts_the_schedule() -> None:
    for detects, expected in ((True, np.zeros(4)), (False, TROT)):
        robot = LowLevel(contact_detection=detects)
        for _ in range(20):
            solution = robot.step(None, WALKING, REST, known_at(0.0, np.zeros(4)))
        assert robot.state is not None
        np.testing.assert_array_equal(robot.state.contact, expected)
        assert solution.solved
        if detects:
            np.testing.assert_array_equal(robot.state.acc_des, [0, 0, -GRAVITY, 0, 0, 0])
        else:
            assert solution.force[0, 2] > 40.0


def test_states_handed_in_are_left_as_they_were() -> None:
    robot = LowLevel()
    robot.step()
    before = robot.state
    assert before is not None
    known = estimate(before, standing(1), WALKING, DT, robot.gains)
    rows = before.row.copy(), known.row.copy()
    again = estimate(before, standing(1), WALKING, DT, robot.gains)
    first, second = (control(state, REST, robot.gains)[1].tau for state in (known, again))
    assert first.tobytes() == second.tobytes()
    np.testing.assert_array_equal(before.row, rows[0])
    np.testing.assert_array_equal(known.row, rows[1])


TICKS = 30


def torques() -> bytes:
    """Of an agent that is held in the air while it begins to trot, (TICKS, 12)."""
    config = Config(
        team=TeamConfig(robots=1), gait=GaitConfig(stand_ms=20), planner=PlannerConfig(kind="none")
    )
    agent = Agent(config, "r1", None)
    state, found = agent.initial(), []
    for tick in range(TICKS):
        reference = Reference(tick, tick * 1_000_000, 0.3, 0.1, 0.2, 0.26)
        state, outputs = agent.step(state, Inputs(standing(tick), references=(reference,)))
        found.append(outputs.command.tau)
    return np.array(found).tobytes()


def test_without_the_compiler_the_torques_are_the_same() -> None:
    script = f"import sys; from {__name__} import torques; sys.stdout.buffer.write(torques())"
    plain = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        check=True,
        capture_output=True,
        cwd=os.getcwd(),
    )
    interpreted = np.frombuffer(plain.stdout).reshape(TICKS, 12)
    compiled = np.frombuffer(torques()).reshape(TICKS, 12)
    assert np.abs(compiled).max() > 1.0
    np.testing.assert_allclose(interpreted, compiled, atol=1e-9)
