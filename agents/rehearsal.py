"""A rehearsal: robots that merely stand are walked, so that everything has run once.

First calls compile, load and allocate; they must not fall into the first steps of a real robot.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.agents.agent import Agent, AgentState, Inputs
from quadriga.agents.gait import first_step, nominal_forces, scheduled_stance, step_ms
from quadriga.agents.planning.central import Central, CentralState
from quadriga.agents.validate import AGREES_MS, standing_torques
from quadriga.shared.codec import decode, encode
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Measurement, Reference, State
from quadriga.shared.robots.conventions import GRAVITY, N_LEGS, N_OUTPUTS, robot_names
from quadriga.shared.robots.spec import RobotSpec
from quadriga.shared.topics import REFERENCE_EPOCH_MS, SAMPLE_MS

_LEAN: Final = 0.8  # of the tilt that is a fall


def rehearse(config: Config, agent: Agent) -> AgentState:
    """Step `agent` through standing, the first walking ticks and some planning steps.

    What it takes in and what it commands goes over the wire's bytes.

    For the last two of them it leans, so far that limits of both its QPs are active. It leans some
    ticks earlier: an attitude that jumps is not believed at once.
    """
    memory, lean = agent.initial(), _LEAN * config.controller.fall_tilt
    still = standing(config.robot, 0)
    upright = config.gait.stand_ms + SAMPLE_MS * config.planner.T_ini + 2 * step_ms(config)
    for tick in range(upright + AGREES_MS + 2 * step_ms(config) + 1):
        sent = encode(_at(still, tick, lean if tick > upright else 0.0))
        inputs = Inputs(decode(sent, State), references=(_stay(config, tick),))
        memory, outputs = agent.step(memory, inputs)
        encode(outputs.command)
    return memory


def rehearse_central(config: Config, central: Central) -> None:
    """Let `central` plan the first two steps of a team that stands.

    What it takes in goes over the wire's bytes.
    """
    state, y = CentralState(), np.zeros(N_OUTPUTS)
    y[0] = config.reference.height
    last = (first_step(config) + 1) * step_ms(config)
    for tick in range(SAMPLE_MS, last + 1, SAMPLE_MS):
        sampled = []
        for index, name in enumerate(robot_names(config.team.robots)):
            stance = scheduled_stance(config, index, np.array([tick - SAMPLE_MS]))[0]
            u = nominal_forces(stance, config.robot.weight)
            sent = encode(Measurement(tick, 0, u, y, stance.astype(float)))
            sampled.append((name, decode(sent, Measurement)))
        state, _ = central.step(central.remember(state, sampled, [_stay(config)]))


def _stay(config: Config, tick: int = 0) -> Reference:
    epoch = tick - tick % REFERENCE_EPOCH_MS
    return Reference(epoch, epoch * 1_000_000, 0.0, 0.0, 0.0, config.reference.height)


def standing(robot: RobotSpec, tick: int, lean: float = 0.0) -> State:
    """What a robot that stands still on flat ground measures, or leans to its right, rad."""
    row, cuts = np.zeros(State.SIZE), State.CUTS
    row[cuts["q_joint"]], row[cuts["tau_joint"]] = robot.q_stand, standing_torques(robot)
    row[cuts["imu_accel"]], row[cuts["foot_force"]] = (0.0, 0.0, GRAVITY), robot.weight / N_LEGS
    return _at(State.from_row(0, 0, row), tick, lean)


def _at(still: State, tick: int, lean: float) -> State:
    """`still` as it is at another tick, and leaning to its right, rad."""
    row = still.row.copy()
    row[State.CUTS["imu_quat_wxyz"]] = np.cos(0.5 * lean), np.sin(0.5 * lean), 0.0, 0.0
    return State.from_row(tick, tick * 1_000_000, row)
