"""What an agent believes of encoders that fail."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from quadriga.agents.encoder_bridge import ENCODERS, EncoderBridge, joints_held, name_joints
from quadriga.shared.robot.a1 import A1
from quadriga.shared.robot.conventions import Array
from quadriga.shared.wire.messages import State
from tests.a1 import standing

DT = 1e-3
FAILS, BACK, END = 300, 800, 1200  # ms
KNEE = 2
BRIDGE = EncoderBridge(A1)


def swinging(tick: int) -> State:
    """A robot that swings all joints as fast as a trot does, with encoders of some noise."""
    chance, t = np.random.default_rng(tick), DT * tick
    q = A1.q_stand + 0.3 * np.sin(25.0 * t) + 5e-4 * chance.standard_normal(12)
    v = 7.5 * np.cos(25.0 * t) + 0.05 * chance.standard_normal(12)
    return replace(standing(tick), q_joint=q, v_joint=v)


def with_knee(state: State, q: float, v: float) -> State:
    angles, rates = state.q_joint.copy(), state.v_joint.copy()
    angles[KNEE], rates[KNEE] = q, v
    return replace(state, q_joint=angles, v_joint=rates)


def be_off(state: State) -> State:
    return with_knee(state, 0.0, 0.0)


def be_garbage(state: State) -> State:
    chance = np.random.default_rng(state.tick + 1_000_000)
    return with_knee(state, chance.uniform(-2.7, -0.9), chance.uniform(-21.0, 21.0))


def be_nothing(state: State) -> State:
    return with_knee(state, state.q_joint[KNEE], np.nan)


def be_beyond(state: State) -> State:
    """A reading that leaves what can be, at a rate that it tells."""
    away = 9.0 * (state.tick - FAILS)
    return with_knee(state, state.q_joint[KNEE] + DT * away, state.v_joint[KNEE] + 9.0)


def be_adrift(state: State) -> State:
    """An angle that turns the wrong way from where it was."""
    past = swinging(FAILS).q_joint[KNEE]
    return with_knee(state, 2.0 * past - state.q_joint[KNEE], state.v_joint[KNEE])


def be_stuck(state: State) -> State:
    """The reading of a joint in motion, again and again."""
    first = swinging(FAILS)
    return with_knee(state, first.q_joint[KNEE], first.v_joint[KNEE])


def follow(spoil: Callable[[State], State]) -> tuple[list[State], list[State]]:
    """What was read and what was believed, by tick."""
    memory: Array | None = None
    read, believed = list[State](), list[State]()
    for tick in range(END):
        state = swinging(tick)
        if FAILS <= tick < BACK:
            state = spoil(state)
        memory, out = BRIDGE.step(memory, state, DT)
        read.append(state)
        believed.append(out)
    return read, believed


def test_sound_encoders_are_believed_as_they_are() -> None:
    read, believed = follow(lambda state: state)
    assert all(a is b for a, b in zip(read, believed, strict=True))


@pytest.mark.parametrize(
    ("spoil", "seen_after", "believed_after"),
    [
        (be_off, 1, 20),
        (be_nothing, 1, 21),
        (be_garbage, 5, 20),
        (be_beyond, 250, 20),
        (be_adrift, 50, 230),
        (be_stuck, 100, 230),
    ],
)
def test_an_encoder_that_fails_is_held_until_it_agrees_with_itself_again(
    spoil: Callable[[State], State], seen_after: int, believed_after: int
) -> None:
    read, believed = follow(spoil)
    seen = next(tick for tick in range(FAILS, BACK) if believed[tick] is not read[tick])
    assert seen - FAILS < seen_after
    others = np.arange(12) != KNEE
    for tick in range(seen, BACK):
        assert believed[tick].q_joint[KNEE] == believed[seen - 1].q_joint[KNEE]
        assert believed[tick].v_joint[KNEE] == 0.0
        np.testing.assert_array_equal(believed[tick].q_joint[others], read[tick].q_joint[others])
        np.testing.assert_array_equal(believed[tick].imu_gyro, read[tick].imu_gyro)
    sound = next(tick for tick in range(BACK, END) if believed[tick] is read[tick])
    assert abs(sound - BACK - believed_after) <= (1 if believed_after <= 21 else 20)


def test_a_reading_at_rest_where_the_joint_has_not_been_of_late_is_never_believed() -> None:
    thigh, memory = KNEE - 1, None
    for tick in range(BACK):
        state = swinging(tick)
        if tick >= FAILS:
            state.row[
                [State.CUTS["q_joint"].start + thigh, State.CUTS["v_joint"].start + thigh]
            ] = 0
        memory, believed = BRIDGE.step(memory, state, DT)
        assert (believed is state) == (tick < FAILS)
    assert memory is not None
    assert joints_held(memory, BACK - FAILS - 2.0) == (thigh,)
    assert joints_held(memory, BACK - FAILS + 2.0) == ()
    assert name_joints((thigh, 6)) == "FL_thigh,RL_hip"


@pytest.mark.parametrize("joint", range(3))
def test_a_thigh_that_stays_the_same_number_while_the_leg_moves_is_held(joint: int) -> None:
    """A hip or knee is not: on one that is stuck a robot walks on."""
    memory: Array | None = None
    for tick in range(END):
        state = swinging(tick)
        if tick >= FAILS:
            state.row[State.CUTS["q_joint"].start + joint] = swinging(FAILS).q_joint[joint]
            state.row[State.CUTS["v_joint"].start + joint] = 0.0
        memory, believed = BRIDGE.step(memory, state, DT)
        if tick < FAILS:
            assert believed is state
    assert memory is not None
    assert (joint in joints_held(memory, END - FAILS - 100.0)) == (joint == KNEE - 1)


def test_one_number_again_and_again_is_believed_while_the_leg_rests() -> None:
    memory: Array | None = None
    for tick in range(END):
        chance, state = np.random.default_rng(tick), standing(tick)
        trembling = state.q_joint + 5e-4 * chance.standard_normal(12)
        state = replace(state, q_joint=trembling, v_joint=0.07 * chance.standard_normal(12))
        state.row[State.CUTS["q_joint"].start + KNEE - 1] = 0.9
        memory, believed = BRIDGE.step(memory, state, DT)
        assert believed is state
        assert memory[ENCODERS.travel][KNEE - 1] == 0.0


def test_a_message_that_comes_again_and_again_tells_of_no_encoder() -> None:
    memory: Array | None = None
    for tick in range(FAILS + 20):
        state = replace(swinging(min(tick, FAILS)), tick=tick)
        memory, _ = BRIDGE.step(memory, state, DT)
    assert memory is not None
    assert memory[ENCODERS.travel].max() == 0.0


def test_where_ticks_were_passed_over_an_angle_may_be_another() -> None:
    memory, _ = BRIDGE.step(None, swinging(0), DT)
    for tick in range(15, 300, 15):
        memory, believed = BRIDGE.step(memory, swinging(tick), 15 * DT)
        assert believed.tick == tick
        np.testing.assert_array_equal(believed.q_joint, swinging(tick).q_joint)


def lowered(tick: int) -> State:
    """A robot that was led down while nobody looked."""
    return replace(standing(tick), q_joint=A1.q_stand + np.tile([0.0, 0.4, -0.8], 4))


def test_after_a_pause_joints_may_be_anywhere() -> None:
    memory: Array | None = None
    for tick in (*range(FAILS), *range(FAILS + 400, END)):
        state = swinging(tick) if tick < FAILS else lowered(tick)
        dt = 400 * DT if tick == FAILS + 400 else DT
        memory, believed = BRIDGE.step(memory, state, dt)
        assert believed is state
    assert memory is not None
    assert joints_held(memory, 0.0) == ()


def test_a_pause_makes_no_failed_encoder_sound() -> None:
    memory: Array | None = None
    for tick in range(BACK):
        failed = be_off(swinging(tick)) if tick >= FAILS else swinging(tick)
        memory, _ = BRIDGE.step(memory, failed, DT)
    for tick in range(BACK + 400, END + 400):
        failed = be_beyond(be_off(lowered(tick)))
        failed.row[State.CUTS["v_joint"].start + KNEE + 3] = np.nan
        memory, believed = BRIDGE.step(memory, failed, 400 * DT if tick == BACK + 400 else DT)
        assert believed.q_joint[KNEE] == swinging(FAILS - 1).q_joint[KNEE]
        assert believed.v_joint[KNEE + 3] == 0.0
    assert memory is not None
    assert joints_held(memory, END - BACK - 1.0) == (KNEE, KNEE + 3)
    assert memory[ENCODERS.held][KNEE + 3] == pytest.approx(DT * (END - BACK))


def test_the_first_reading_is_believed() -> None:
    state = be_off(standing(0))
    _, believed = BRIDGE.step(None, state, DT)
    assert believed is state


def test_what_a_failure_takes_is_loaded_before_one() -> None:
    program = (
        "from quadriga.agents import encoder_bridge as bridge\n"
        "from quadriga.shared.robot.a1 import A1\n"
        "of_failures = bridge._hold, bridge._begin_anew\n"
        "print([len(function.signatures) for function in of_failures])\n"
        "bridge.EncoderBridge(A1)\n"
        "print([len(function.signatures) for function in of_failures])\n"
    )
    said = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert said.stdout.split("\n")[:2] == ["[0, 0]", "[1, 1]"], said.stderr
