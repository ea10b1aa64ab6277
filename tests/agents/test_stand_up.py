"""A robot that was damped stands up after the operator's reset: when, how, and what ends it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quadriga.agents.agent import Agent, Inputs
from quadriga.agents.stand_up import StandUp, StandUpRules
from quadriga.plant.commands import damp_joints
from quadriga.shared.codes import LIES
from quadriga.shared.config.load import load
from quadriga.shared.messages import EStop, Event, Reset, State
from quadriga.shared.modes import ESTOP, PASSIVE, STAND, STANDING_UP, STOPPING, WALK, Mode
from quadriga.shared.robots.conventions import Array
from quadriga.shared.robots.motions import way_up
from quadriga.sim_server.world.world import World
from tests.a1 import standing

CONFIG = load(None, {"team.robots": 1, "planner.kind": "none"})
ROBOT = CONFIG.robot
FROM = 5000  # tick of the reset
RELEASE = Reset(FROM, 0, "ann")
STOPPED = Mode(ESTOP, 700, "estop:dog")
UP = Mode(STANDING_UP, FROM, "reset:ann")
MOVING = StandUp(ROBOT.q_lying, FROM, way_up(ROBOT.q_lying, ROBOT, 1.5))
RULES = StandUpRules(CONFIG)


def lying(tick: int, **changes: Array) -> State:
    return replace(standing(tick), q_joint=ROBOT.q_lying, **changes)  # type: ignore[arg-type]


def rolled(angle: float) -> Array:
    return np.array([np.cos(angle / 2), np.sin(angle / 2), 0.0, 0.0])


@pytest.mark.parametrize(
    ("mode", "changes", "begins"),
    [
        (STOPPED, {}, True),
        (Mode(PASSIVE, 700, "not-up"), {}, True),
        (STOPPED, {"estop": EStop(FROM, 0, "dog")}, False),
        (STOPPED, {"reset": None}, False),
        (STOPPED, {"reset": Reset(699, 0, "ann")}, False),  # sent before the stop
        *((Mode(name, 300), {}, False) for name in (WALK, STAND, STOPPING, STANDING_UP)),
    ],
)
def test_it_begins_when_the_operator_releases_a_robot_that_is_damped(
    mode: Mode, changes: dict[str, object], begins: bool
) -> None:
    inputs = replace(Inputs(lying(FROM), reset=RELEASE), **changes)  # type: ignore[arg-type]
    assert RULES.begins(mode, inputs) is begins
    keys = {"team.plant": "robots", "team.plant_per_robot": True, "team.yokes": "none"}
    given = {"team.robots": 1, "world.mode": "realtime", "planner.kind": "none"}
    assert not StandUpRules(load(None, given | keys)).begins(mode, inputs), "of a real robot"


def test_it_stays_where_it_is_until_the_others_rest_and_asks_for_no_great_torque() -> None:
    limit = 0.8 * ROBOT.torque_limit
    inputs = Inputs(lying(FROM), reset=RELEASE)
    mode, stand_up, command = RULES.step(STOPPED, None, inputs, may_move=False)
    assert mode == UP
    assert np.array_equal(command.q_des, ROBOT.q_lying)
    tick = FROM
    while mode.name == STANDING_UP and tick < FROM + 5000:
        tick += 7
        moves = tick >= FROM + 1000
        mode, stand_up, command = RULES.step(mode, stand_up, Inputs(lying(tick)), may_move=moves)
        asked = command.kp * (command.q_des - ROBOT.q_lying)
        assert (np.abs(asked) <= limit + 1e-9).all()
        assert stand_up is None or (stand_up.motion is not None) is moves
    assert (mode.name, mode.reason) == (PASSIVE, "not-up"), "it never came off the ground"


def test_it_stands_only_once_its_joints_are_there_and_the_trunk_is_level() -> None:
    end = FROM + 1500 + 200
    leaning = replace(standing(end), imu_quat_wxyz=rolled(0.5))
    for state in (standing(end - 10), leaning, lying(end)):
        assert RULES.step(UP, MOVING, Inputs(state), may_move=True)[0] == UP
    mode, stand_up, _ = RULES.step(UP, MOVING, Inputs(standing(end)), may_move=True)
    assert (mode, stand_up) == (Mode(STAND, end, "reset:ann"), None)


@pytest.mark.parametrize(
    ("inputs", "after"),
    [
        (Inputs(lying(FROM + 9, imu_quat_wxyz=rolled(1.2))), Mode(PASSIVE, FROM + 9, "fall")),
        (
            Inputs(lying(FROM + 9, imu_quat_wxyz=np.full(4, np.nan))),
            Mode(PASSIVE, FROM + 9, "no-estimate"),
        ),
        (Inputs(lying(FROM + 9), estop=EStop(FROM, 0, "dog")), Mode(ESTOP, FROM + 9, "estop:dog")),
    ],
)
def test_a_fall_and_an_emergency_stop_damp_it_again(inputs: Inputs, after: Mode) -> None:
    mode, _, command = RULES.step(UP, MOVING, inputs, may_move=True)
    assert mode == after
    assert not command.kp.any()
    assert (command.kd == CONFIG.controller.damping).all()


@pytest.mark.parametrize("lies_ms", [30, 2000], ids=["sinking", "lying"])
def test_a_simulated_robot_that_was_stopped_stands_again_without_a_fall(lies_ms: int) -> None:
    world, agent = World(CONFIG), Agent(CONFIG, "r1", None)
    memory, modes, events, torque = agent.initial(), list[str](), list[Event](), 0.0

    def step(count: int, **first: object) -> None:
        nonlocal memory, torque
        for _ in range(count):
            inputs = Inputs(world.states()["r1"], **first)  # type: ignore[arg-type]
            memory, outputs = agent.step(memory, inputs)
            first = {}
            modes.extend([] if outputs.mode in modes[-1:] else [outputs.mode])
            damped = {"r1": damp_joints(world.tick)}
            events.extend(world.step(damped if memory.mode.passive else {"r1": outputs.command}))
            torque = max(torque, float(np.abs(world.motors.torque / ROBOT.torque_limit).max()))

    step(300)
    world.expect_down(("r1",))
    step(lies_ms, estop=EStop(300, 0, "dog"))
    world.expect_down(())
    torque = 0.0
    step(3500, reset=RELEASE)
    assert modes == [STAND, ESTOP, STANDING_UP, STAND]
    assert memory.mode.reason == "reset:ann"
    lain = [event.code for event in events if event.kind == "fault"]
    assert lain == ([LIES] if lies_ms > 1000 else [])
    height = world.truth().base_pos[0, 2]
    assert height == pytest.approx(CONFIG.reference.height, abs=0.02)
    assert torque < 0.9, "of what the motors can"
    while not world.fallen() and world.tick < 15_000:
        world.step({})
    assert world.fallen() == ("r1",), "from now on it may fall"
