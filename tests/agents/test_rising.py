"""A robot that was led down gets up where it is: when, how, and when it is not let up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quadriga.agents.agent import Agent, Inputs
from quadriga.agents.modes import DAMPING, ESTOP, RISING, STAND, STOPPING, WALK, Mode
from quadriga.agents.rising import Rise, Rising
from quadriga.plant.late import damp_joints
from quadriga.plant.lost import LostCommands
from quadriga.shared.codes import BACK, LIES, LOWERED
from quadriga.shared.config.load import load
from quadriga.shared.messages import EStop, Event, Reset, State
from quadriga.sim_server.world.world import World
from tests.a1 import standing
from tests.sim_server.standing import stand

CONFIG = load(None, {"team.robots": 1, "world.mode": "realtime", "planner.kind": "none"})
ROBOT = CONFIG.robot
FROM = 5000  # tick at which the agent is back
RISES = Mode(RISING, FROM, "led-down")


def lying(tick: int, **changes: object) -> State:
    return replace(standing(tick), q_joint=ROBOT.q_lying, **changes)  # type: ignore[arg-type]


def rolled(angle: float) -> np.ndarray:
    return np.array([np.cos(angle / 2), np.sin(angle / 2), 0.0, 0.0])


@pytest.mark.parametrize(
    ("mode", "last", "tick", "due"),
    [
        (Mode(STAND, 0), -1, 0, False),
        (Mode(STAND, 0), -1, 300, False),  # late, but the team has stood all the time
        (Mode(STAND, 0), -1, 301, True),  # started while its team walks
        (Mode(WALK, 300), 4800, 5000, False),  # the motors have only been held
        (Mode(WALK, 300), 4799, 5000, True),
        (Mode(DAMPING, 300, "fall"), 1000, 5000, False),
        (Mode(ESTOP, 300, "estop"), 1000, 5000, False),
    ],
)
def test_it_gets_up_after_its_motors_were_led_down(
    mode: Mode, last: int, tick: int, due: bool
) -> None:
    assert Rising(CONFIG).why_now(mode, last, tick, None, None) == ("led-down" if due else "")


@pytest.mark.parametrize("keys", [{"world.mode": "lockstep"}, {"team.plant": "robots"}])
def test_never_in_lockstep_and_never_a_real_robot(keys: dict[str, str]) -> None:
    each = {"team.plant_per_robot": True, "team.yokes": "none"} if "team.plant" in keys else {}
    given = {"team.robots": 1, "world.mode": "realtime", "planner.kind": "none"}
    rising = Rising(load(None, given | each | keys))
    assert not rising.why_now(Mode(STAND, 0), -1, FROM, None, None)


def test_it_stays_where_it_is_until_the_others_stand_and_asks_for_no_great_torque() -> None:
    rising, limit = Rising(CONFIG), 0.8 * ROBOT.torque_limit
    mode, rise, command = rising.step(RISES, None, lying(FROM), may_begin=False)
    assert mode == RISES
    assert np.array_equal(command.q_des, ROBOT.q_lying)
    tick = FROM
    while mode.name == RISING and tick < FROM + 5000:
        tick += 7
        begins = tick >= FROM + 1000
        mode, rise, command = rising.step(mode, rise, lying(tick), may_begin=begins)
        asked = command.kp * (command.q_des - ROBOT.q_lying)
        assert (np.abs(asked) <= limit + 1e-9).all()
        assert rise is None or (rise.begun >= 0) is begins
    assert mode.reason == "not-up", "it never came off the ground"
    assert mode.name == DAMPING


def test_it_stands_only_once_its_joints_are_there_and_the_trunk_is_level() -> None:
    rising = Rising(CONFIG)
    mode, rise, _ = rising.step(RISES, None, lying(FROM), may_begin=True)
    end = FROM + 1500 + 200
    early = rising.step(mode, rise, standing(end - 10), may_begin=True)
    assert early.mode == RISES
    leaning = replace(standing(end), imu_quat_wxyz=rolled(0.5))
    assert rising.step(mode, rise, leaning, may_begin=True).mode == RISES
    assert rising.step(mode, rise, lying(end), may_begin=True).mode == RISES
    up = rising.step(mode, rise, standing(end), may_begin=True)
    assert up.mode == Mode(STAND, end, "led-down")
    assert up.rise is None


def test_who_is_led_down_on_the_way_up_begins_anew() -> None:
    agent = Agent(CONFIG, "r1", None)
    memory, _ = agent.step(agent.initial(), Inputs(lying(FROM)))
    for tick in range(FROM + 1, FROM + 1700):
        memory, _ = agent.step(memory, Inputs(lying(tick)))
    assert memory.rise is not None
    memory, outputs = agent.step(memory, Inputs(lying(FROM + 2000)))
    assert (outputs.mode, memory.mode.since) == (RISING, FROM + 2000)
    assert np.abs(outputs.command.q_des - ROBOT.q_lying).max() < 0.01, "from where it is now"


def test_who_did_not_know_that_its_commands_came_too_late_gets_up_when_told() -> None:
    agent, told = Agent(CONFIG, "r1", None), Event.of(50, LOWERED, "r1", "led down")
    memory = agent.initial()
    for tick in range(50):
        memory, outputs = agent.step(memory, Inputs(standing(tick)))
    assert outputs.mode == STAND
    memory, outputs = agent.step(memory, Inputs(lying(50), events=(told,)))
    assert memory.mode == Mode(RISING, 50, "led-down")
    assert np.abs(outputs.command.q_des - ROBOT.q_lying).max() < 0.01, "no torque of a stand"
    for tick in range(51, 1500):
        memory, outputs = agent.step(memory, Inputs(lying(tick)))
    assert memory.rise is not None
    assert memory.rise.begun == -1, "it waits until the plant follows its commands"
    back = Event.of(1500, BACK, "r1", "answers again")
    memory, outputs = agent.step(memory, Inputs(lying(1500), events=(back,)))
    assert memory.rise is not None
    assert memory.rise.begun == 1500


def test_a_fall_and_an_emergency_stop_damp_it_for_good() -> None:
    rising, rise = Rising(CONFIG), Rise(ROBOT.q_lying, FROM)
    fallen = rising.step(RISES, rise, lying(FROM + 9, imu_quat_wxyz=rolled(1.2)), may_begin=True)
    assert fallen.mode == Mode(DAMPING, FROM + 9, "fall")
    assert not fallen.command.kp.any()
    assert (fallen.command.kd == CONFIG.controller.damping).all()
    nothing = np.full(4, np.nan)
    unknown = rising.step(RISES, rise, lying(FROM + 9, imu_quat_wxyz=nothing), may_begin=True)
    assert unknown.mode.reason == "no-estimate"
    stop = EStop(FROM, 0, "dog")
    stopped = rising.step(RISES, rise, lying(FROM + 9), may_begin=True, estop=stop)
    assert stopped.mode == Mode(ESTOP, FROM + 9, "estop:dog")


@pytest.mark.parametrize(
    ("down_ms", "below"), [(1000, 0.18), (2700, 0.12)], ids=["half way down", "lying"]
)
def test_a_simulated_robot_that_was_led_down_stands_again_without_a_fall(
    down_ms: int, below: float
) -> None:
    world, lost = World(CONFIG), LostCommands(CONFIG)
    stand(world, 300)
    for _ in range(down_ms):
        world.expect_down(lost.lowered)
        world.step(lost.fill(world.tick, world.names, {}, world.states))
    assert world.truth().base_pos[0, 2] < below
    world.expect_down(())
    agent = Agent(CONFIG, "r1", None)
    memory, modes, torque = agent.initial(), list[str](), 0.0
    for _ in range(2600):
        memory, outputs = agent.step(memory, Inputs(world.states()["r1"]))
        modes += [outputs.mode] if outputs.mode not in modes else []
        assert not world.step({"r1": outputs.command})
        torque = max(torque, float(np.abs(world.motors.torque / ROBOT.torque_limit).max()))
    assert modes == [RISING, STAND]
    assert memory.mode.reason == "led-down"
    height = world.truth().base_pos[0, 2]
    assert height == pytest.approx(CONFIG.reference.height, abs=0.02)
    assert torque < 0.9, "of what the motors can"
    while not world.fallen() and world.tick < 10_000:
        world.step({})
    assert world.fallen() == ("r1",), "from now on it may fall"


RELEASE = Reset(FROM, 0, "ann")
STOPPED_WALK = Mode(ESTOP, 700, "estop:dog")


@pytest.mark.parametrize("mode", [STOPPED_WALK, Mode(DAMPING, 700, "not-up")])
@pytest.mark.parametrize("walk", ["lockstep", "realtime"])
def test_who_is_damped_gets_up_when_the_operator_releases_it_by_name(walk: str, mode: Mode) -> None:
    rising = Rising(replace(CONFIG, world=replace(CONFIG.world, mode=walk)))
    assert rising.why_now(mode, FROM - 1, FROM, RELEASE, None) == "reset:ann"
    assert not rising.why_now(mode, FROM - 1, FROM, RELEASE, EStop(FROM, 0, "dog"))
    assert not rising.why_now(mode, FROM - 1, FROM, None, None)
    early = Reset(mode.since - 1, 0, "ann")
    assert not rising.why_now(mode, FROM - 1, FROM, early, None), "said before the stop"
    for other in (Mode(WALK, 300), Mode(STAND, 0), Mode(STOPPING, 5, "stopped:ann"), RISES):
        assert not rising.why_now(other, FROM - 1, FROM, RELEASE, None)


def test_a_real_robot_is_not_released_over_the_bus() -> None:
    keys = {"team.plant": "robots", "team.plant_per_robot": True, "team.yokes": "none"}
    given = {"team.robots": 1, "world.mode": "realtime", "planner.kind": "none"}
    assert not Rising(load(None, given | keys)).why_now(STOPPED_WALK, 4999, FROM, RELEASE, None)


def test_who_was_told_to_stop_before_it_was_led_down_does_not_go_on_by_itself() -> None:
    asked = Mode(STAND, 900, "stopped:ann")
    assert Rising(CONFIG).why_now(asked, 1000, FROM, None, None) == "stopped:ann"
    lost = Mode(STAND, 900, "peer-lost:r2")
    assert Rising(CONFIG).why_now(lost, 1000, FROM, None, None) == "led-down"


@pytest.mark.parametrize("lies_ms", [30, 2000], ids=["sinking", "lying"])
def test_a_simulated_robot_that_was_stopped_gets_up_after_its_release(lies_ms: int) -> None:
    world, agent = World(CONFIG), Agent(CONFIG, "r1", None)
    memory, modes, events = agent.initial(), list[str](), list[Event]()

    def step(count: int, **first: object) -> None:
        nonlocal memory
        for _ in range(count):
            inputs = Inputs(world.states()["r1"], **first)  # type: ignore[arg-type]
            memory, outputs = agent.step(memory, inputs)
            first = {}
            modes.extend([] if outputs.mode in modes[-1:] else [outputs.mode])
            damped = {"r1": damp_joints(world.tick)}
            events.extend(world.step(damped if memory.mode.passive else {"r1": outputs.command}))

    step(300)
    world.expect_down((), stopped=("r1",))
    step(lies_ms, estop=EStop(300, 0, "dog"))
    world.expect_down(())
    step(3000, reset=RELEASE)
    assert modes == [STAND, ESTOP, RISING, STAND]
    assert memory.mode.reason == "reset:ann"
    sunk = [event.code for event in events if event.kind == "fault"]
    assert sunk == ([LIES] if lies_ms > 1000 else [])
    height = world.truth().base_pos[0, 2]
    assert height == pytest.approx(CONFIG.reference.height, abs=0.02)
