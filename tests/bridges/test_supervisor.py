"""The nine states of a bridge, and every reason to stop."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.bridges.supervisor import (
    BridgeMode,
    Request,
    Supervised,
    Supervisor,
    SupervisorInputs,
    SupervisorState,
    tilt_of,
)
from quadriga.shared.messages import Command
from quadriga.shared.robots.conventions import JOINT_NAMES
from quadriga.shared.unitree.packets import OFF, PROTECTED, SERVO, Battery
from tests.bridges.robots import config_of, pressing, standing, tilted

CONFIG = config_of()
ROBOT = CONFIG.robot
SUPERVISOR = Supervisor(ROBOT, CONFIG.bridge, SERVO)
REPORT = standing(CONFIG)
COMMAND = Command(
    0, 0, np.full(12, 2.0), ROBOT.q_stand, np.zeros(12), np.full(12, 30.0), np.ones(12)
)


def at(now: int = 100, **fields: Any) -> SupervisorInputs:
    inputs = SupervisorInputs(now=now, report=REPORT, report_age=0, command=COMMAND)
    return replace(inputs, **fields)


def in_mode(mode: BridgeMode, **fields: Any) -> SupervisorState:
    state = SUPERVISOR.initial(0, armed=True)
    return replace(state, mode=mode, **fields)


def step(state: SupervisorState, inputs: SupervisorInputs) -> tuple[SupervisorState, Supervised]:
    return SUPERVISOR.step(state, inputs)


@given(st.sampled_from(list(Request)), st.integers(0, 10**6))
def test_a_dry_run_never_sends(request: Request, now: int) -> None:
    state = SUPERVISOR.initial(0, armed=False)
    after, supervised = step(state, at(now, request=request))
    assert supervised.targets is None
    assert after.mode is BridgeMode.DRY


def test_up_walk_and_down() -> None:
    """From passive over standing up, standing, walking, lying down to passive, each named once."""
    state, named = SUPERVISOR.initial(0, armed=True), list[BridgeMode]()
    ends = round(1000 * CONFIG.bridge.stand_s)
    requests = [Request.STAND] * (ends + 3) + [Request.WALK] * 50 + [Request.LIE] * (ends + 1003)
    for now, request in enumerate(requests):
        state, supervised = step(state, at(now, request=request))
        named += [mode for mode, _ in supervised.changes]
        assert supervised.targets is not None
    assert named == [
        BridgeMode.STANDING_UP,
        BridgeMode.STAND,
        BridgeMode.WALK,
        BridgeMode.LYING_DOWN,
        BridgeMode.RELEASING,
        BridgeMode.PASSIVE,
    ]


def test_a_passive_robot_has_its_motors_off_and_a_walking_one_follows_its_agent() -> None:
    _, supervised = step(in_mode(BridgeMode.PASSIVE), at())
    assert supervised.targets is not None
    assert (supervised.targets.mode == OFF).all()
    np.testing.assert_array_equal(supervised.targets.kp, 0.0)
    _, supervised = step(in_mode(BridgeMode.WALK), at(request=Request.WALK, command_age=3))
    assert supervised.targets is not None
    np.testing.assert_allclose(supervised.targets.tau, COMMAND.tau)
    np.testing.assert_allclose(supervised.targets.kp, COMMAND.kp)
    assert (supervised.targets.mode == SERVO).all()


def test_a_late_agent_is_waited_for_with_the_joints_held_then_the_robot_stops() -> None:
    state = in_mode(BridgeMode.WALK)
    hold, damp = CONFIG.bridge.hold_ms, CONFIG.bridge.damp_ms
    first = standing(CONFIG, q=ROBOT.q_stand + 0.1)
    state, held = step(state, at(request=Request.WALK, report=first, command_age=hold + 1))
    assert held.targets is not None
    np.testing.assert_allclose(held.targets.q, first.q)
    state, held = step(state, at(102, request=Request.WALK, command_age=damp))
    assert held.targets is not None
    np.testing.assert_allclose(held.targets.q, first.q)
    fresh, _ = step(state, at(103, request=Request.WALK, command_age=0))
    assert (fresh.mode, fresh.held) == (BridgeMode.WALK, None)
    stopped, supervised = step(state, at(103, request=Request.WALK, command_age=damp + 1))
    assert (stopped.mode, stopped.reason) == (BridgeMode.ESTOP, f"command-late:{damp + 1} ms")
    assert supervised.targets is not None
    np.testing.assert_array_equal(supervised.targets.kp, 0.0)
    assert (supervised.targets.kd > 0.0).all()


SICK = {
    "remote": standing(CONFIG, remote=pressing("L2", "B", "up")),
    "tilt": standing(CONFIG, quat_wxyz=tilted(0.95)),
    "motor-protected": standing(CONFIG, mode=np.array([SERVO] * 11 + [PROTECTED], np.uint8)),
    "temperature": standing(CONFIG, temperature=np.full(12, 79.0)),
    "battery": standing(CONFIG, battery=Battery(9, -5.0, 20.0)),
    "joint-reading": standing(CONFIG, q=np.full(12, np.nan)),
}


@pytest.mark.parametrize("mode", [BridgeMode.STAND, BridgeMode.WALK])
@pytest.mark.parametrize("reason", list(SICK))
def test_a_sick_robot_stops_for_good(mode: BridgeMode, reason: str) -> None:
    state, supervised = step(in_mode(mode), at(request=Request.WALK, report=SICK[reason]))
    assert state.mode is BridgeMode.ESTOP
    assert state.reason.partition(":")[0] == reason
    assert supervised.changes == ((BridgeMode.ESTOP, state.reason),)
    for request in Request:  # nothing brings it back
        again, _ = step(state, at(101, request=request))
        assert again.mode is BridgeMode.ESTOP


@pytest.mark.parametrize(("kind", "warm", "hot"), [("a1", 71.0, 79.0), ("go2", 81.0, 89.0)])
def test_a_hot_motor_is_warned_of_before_it_stops_the_robot(
    kind: str, warm: float, hot: float
) -> None:
    config = config_of(kind)
    supervisor = Supervisor(config.robot, config.bridge, SERVO)

    def at_heat(degrees: float) -> tuple[str, str]:
        heat = np.where(np.arange(12) == 5, degrees, 40.0)
        inputs = at(report=standing(config, temperature=heat))
        state, _ = supervisor.step(in_mode(BridgeMode.STAND), inputs)
        return supervisor.warning(inputs.report)[:17], state.reason

    assert at_heat(warm - 1.0) == ("", "")
    assert at_heat(hot - 1.0) == at_heat(warm) == ("hot:FR_calf_joint", "")
    assert at_heat(hot)[1].startswith("temperature:FR_calf_joint")


@given(st.integers(1, 4), st.integers(0, 11), st.sampled_from([-1.0, 1.0]))
def test_a_joint_that_stays_too_fast_stops_the_robot(period: int, joint: int, sign: float) -> None:
    """A swing leg may pass the limit for a moment; a joint that runs away may not."""
    dq = np.zeros(12)
    dq[joint] = sign * 1.01 * CONFIG.bridge.speed_share * ROBOT.speed[joint % 3]
    fast, state = standing(CONFIG, dq=dq), in_mode(BridgeMode.WALK, sent=100)
    for now in range(100 + period, 100 + CONFIG.bridge.speed_ms + 1, period):
        state, _ = step(state, at(now, request=Request.WALK, report=fast))
        assert state.mode is BridgeMode.WALK
    calm, _ = step(state, at(now + 1, request=Request.WALK))
    assert (calm.mode, calm.fast_ms) == (BridgeMode.WALK, 0)
    state, _ = step(state, at(now + period, request=Request.WALK, report=fast))
    assert state.mode is BridgeMode.ESTOP
    assert state.reason.startswith(f"speed:{JOINT_NAMES[joint]} ")


@pytest.mark.parametrize("mode", [m for m in BridgeMode if m is not BridgeMode.DRY])
def test_an_emergency_stop_of_the_team_stops_a_robot_in_every_state(mode: BridgeMode) -> None:
    state, _ = step(in_mode(mode), at(estop="dog on the track"))
    assert state.mode is BridgeMode.ESTOP
    assert mode is BridgeMode.ESTOP or state.reason == "estop:dog on the track"


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ({"report_age": 71}, "report-late"),
        ({"writers": 1}, "second-writer"),
        ({"writers": 1, "stall": 71}, "bridge-late"),  # it is the watchdog
        ({"writers": 1, "watched": False}, "watchdog-gone"),
    ],
)
def test_a_lost_robot_or_another_writer_stops_it(fields: dict[str, Any], reason: str) -> None:
    state, _ = step(in_mode(BridgeMode.STAND), at(**fields))
    assert state.reason.partition(":")[0] == reason


def test_a_stopped_robot_is_damped_and_then_passive() -> None:
    state = in_mode(BridgeMode.ESTOP, since=0)
    end = round(1000 * CONFIG.bridge.passive_s)
    _, damped = step(state, at(end))
    _, passive = step(state, at(end + 1))
    assert damped.targets is not None
    assert passive.targets is not None
    assert (damped.targets.mode == SERVO).all()
    assert (passive.targets.mode == OFF).all()


def test_the_stop_buttons_hold_a_passive_robot_down_too() -> None:
    inputs = at(request=Request.STAND, report=standing(CONFIG, remote=pressing("L2", "B")))
    assert step(in_mode(BridgeMode.PASSIVE), inputs)[0].mode is BridgeMode.ESTOP
    one = at(request=Request.STAND, report=standing(CONFIG, remote=pressing("B")))
    assert step(in_mode(BridgeMode.PASSIVE), one)[0].mode is BridgeMode.STANDING_UP


def test_nobody_walks_before_the_agent_has_spoken() -> None:
    standing_still = in_mode(BridgeMode.STAND)
    for fields in ({"command": None}, {"command_age": 21}):
        state, _ = step(standing_still, at(request=Request.WALK, **fields))
        assert state.mode is BridgeMode.STAND


@given(st.floats(-3.1, 3.1))
def test_the_tilt_is_the_angle_to_the_vertical(angle: float) -> None:
    assert tilt_of(3.0 * tilted(angle)) == pytest.approx(abs(angle), abs=1e-6)
    assert tilt_of(np.zeros(4)) == pytest.approx(np.pi)
    assert tilt_of(np.full(4, np.nan)) == pytest.approx(np.pi)
