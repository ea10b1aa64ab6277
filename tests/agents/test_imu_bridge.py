"""What an agent believes of an IMU that fails, kind by kind."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from quadriga.agents.controller.foot_load import FOOT_LOAD
from quadriga.agents.controller.memory import MEMORY, Memory, initial_memory
from quadriga.agents.imu_bridge import BELIEVED_AFTER_MS, ImuBridge, ImuState
from quadriga.shared.robot.a1 import A1
from quadriga.shared.robot.conventions import GRAVITY, Array
from quadriga.shared.wire.messages import State
from tests.a1 import leg_kinematics, standing
from tests.agents.still_feet import rates_over_still_feet

DT = 1e-3
BRIDGE = ImuBridge(A1)
FAILS, BACK, END = 300, 800, 900  # ms


def rocking(tick: int) -> State:
    """A robot that rocks about its x axis, with an IMU of some noise."""
    chance, t = np.random.default_rng(tick), DT * tick
    roll, rate = 0.1 * np.sin(8.0 * t), 0.8 * np.cos(8.0 * t)
    noise = chance.standard_normal(10)
    return replace(
        standing(tick),
        imu_quat_wxyz=np.array([np.cos(roll / 2), np.sin(roll / 2), 0.0, 0.0]) + 1e-4 * noise[:4],
        imu_gyro=np.array([rate, 0.0, 0.0]) + 0.01 * noise[4:7],
        imu_accel=GRAVITY * np.array([0.0, np.sin(roll), np.cos(roll)]) + 0.3 * noise[7:],
    )


def imu_of(state: State) -> Array:
    return np.concatenate([state.imu_quat_wxyz, state.imu_gyro, state.imu_accel])


def be_off(state: State) -> State:
    zero = np.zeros(3)
    return replace(state, imu_quat_wxyz=np.zeros(4), imu_gyro=zero, imu_accel=zero)


def be_stuck(_state: State) -> State:
    last = rocking(FAILS - 1)
    return replace(last, tick=_state.tick)


def be_garbage(state: State) -> State:
    chance = np.random.default_rng(state.tick + 1_000_000)
    quat = chance.uniform(-1.0, 1.0, 4)
    return replace(
        state,
        imu_quat_wxyz=quat / np.linalg.norm(quat),
        imu_gyro=chance.uniform(-35.0, 35.0, 3),
        imu_accel=chance.uniform(-157.0, 157.0, 3),
    )


def be_wrong(state: State) -> State:
    c, s = np.cos(0.1), np.sin(0.1)
    w, x, y, z = state.imu_quat_wxyz
    return replace(
        state,
        imu_quat_wxyz=np.array([c * w - s * x, c * x + s * w, c * y + s * z, c * z - s * y]),
        imu_gyro=-state.imu_gyro,
        imu_accel=-state.imu_accel,
    )


def follow(spoil: Callable[[State], State]) -> tuple[list[State], list[State], list[float]]:
    """What was read and what was believed, and for how long nothing was, by tick."""
    memory = ImuState()
    read, believed, missing = list[State](), list[State](), list[float]()
    for tick in range(END):
        state = rocking(tick)
        if FAILS <= tick < BACK:
            state = spoil(state)
        memory, out = BRIDGE.step(memory, state, None, 1, DT)
        read.append(state)
        believed.append(out)
        missing.append(memory.missing_ms)
    return read, believed, missing


def test_a_sound_imu_is_believed_as_it_is() -> None:
    read, believed, missing = follow(lambda state: state)
    assert all(a is b for a, b in zip(read, believed, strict=True))
    assert not any(missing)


@pytest.mark.parametrize(
    ("spoil", "seen_after"), [(be_off, 1), (be_garbage, 1), (be_wrong, 1), (be_stuck, 22)]
)
def test_an_imu_that_fails_is_bridged_until_it_agrees_with_itself_again(
    spoil: Callable[[State], State], seen_after: int
) -> None:
    read, believed, missing = follow(spoil)
    seen = next(tick for tick in range(FAILS, BACK) if missing[tick])
    assert seen - FAILS < seen_after
    last = believed[seen - 1].imu_quat_wxyz
    for tick in range(seen, BACK):
        state = believed[tick]
        assert missing[tick] == pytest.approx(tick - seen + 1)
        np.testing.assert_allclose(
            state.imu_quat_wxyz, last / np.linalg.norm(last), rtol=0, atol=1e-12
        )
        assert not state.imu_gyro.any()
        assert np.linalg.norm(state.imu_accel) == pytest.approx(GRAVITY)
        np.testing.assert_array_equal(state.q_joint, read[tick].q_joint)
    sound = next(tick for tick in range(BACK, END) if believed[tick] is read[tick])
    assert BELIEVED_AFTER_MS - 1 <= sound - BACK < 3 * BELIEVED_AFTER_MS
    assert not any(missing[sound:])


def saturate(state: State) -> State:
    return replace(state, imu_accel=np.array([157.0, -157.0, 157.0]))


def fall_silent(state: State) -> State:
    return replace(state, imu_accel=np.zeros(3))


@pytest.mark.parametrize("spoil", [saturate, fall_silent])
def test_of_an_accelerometer_that_fails_gravity_takes_the_place(
    spoil: Callable[[State], State],
) -> None:
    read, believed, missing = follow(spoil)
    assert not any(missing)
    for tick in range(FAILS, BACK):
        np.testing.assert_array_equal(believed[tick].imu_quat_wxyz, read[tick].imu_quat_wxyz)
        np.testing.assert_array_equal(believed[tick].imu_gyro, read[tick].imu_gyro)
        assert np.linalg.norm(believed[tick].imu_accel) == pytest.approx(GRAVITY)
        assert believed[tick].imu_accel[2] > 0.9 * GRAVITY
    assert believed[-1] is read[-1]


def test_a_robot_that_stands_still_may_read_the_same_for_long() -> None:
    memory = ImuState()
    for tick in range(500):
        state = standing(tick)
        memory, believed = BRIDGE.step(memory, state, None, 1, DT)
        assert believed is state


def test_without_any_reading_the_trunk_is_level() -> None:
    memory = ImuState()
    memory, believed = BRIDGE.step(memory, be_off(standing(0)), None, 1, DT)
    np.testing.assert_array_equal(imu_of(believed), [1, 0, 0, 0, 0, 0, 0, 0, 0, GRAVITY])
    assert memory.missing_ms == pytest.approx(1.0)


def test_what_the_feet_bear_takes_the_place_of_the_accelerometer() -> None:
    flat = initial_memory()
    force = flat[MEMORY.foot_load][FOOT_LOAD.force].reshape(4, 3)
    force[[0, 3], 2] = 0.75 * A1.weight  # a trunk that is pushed up by half of its weight
    _, believed = BRIDGE.step(ImuState(), be_off(standing(0)), Memory(flat), 1, DT)
    np.testing.assert_allclose(believed.imu_accel, [0.0, 0.0, 1.5 * GRAVITY])
    force[:, 2] = -A1.weight, 0.0, 0.0, 0.0  # torques say what cannot be
    _, believed = BRIDGE.step(ImuState(), be_off(standing(0)), Memory(flat), 1, DT)
    np.testing.assert_array_equal(believed.imu_accel, 0.0)


def test_an_imu_upside_down_is_not_believed_in_free_fall() -> None:
    memory = ImuState()
    for tick in range(END):
        state = rocking(tick)
        if tick >= FAILS:
            falls = 500 <= tick < 560  # and then measures hardly anything
            state = be_wrong(replace(state, imu_accel=(0.01 if falls else 1.0) * state.imu_accel))
        memory, believed = BRIDGE.step(memory, state, None, 1, DT)
        assert (believed is state) == (tick < FAILS)


def test_the_attitude_goes_on_as_the_legs_say_that_the_trunk_turns() -> None:
    flat, memory = initial_memory(), ImuState()
    flat[MEMORY.contact] = 1.0, 0.0, 0.0, 1.0
    place, _, _ = leg_kinematics(A1.q_stand, np.zeros(12))
    omega = 2.0 * np.cross(place[0] - place[3], [1.0, 0.0, 0.0])  # across the line of the two feet
    rates = rates_over_still_feet(A1.q_stand, np.zeros(3), omega)
    for tick in range(250):
        state = be_off(replace(standing(tick), v_joint=rates))
        memory, believed = BRIDGE.step(memory, state, Memory(flat), 1, DT)
        np.testing.assert_allclose(believed.imu_gyro, omega, atol=1e-9)
    angle = 0.25 * np.linalg.norm(omega)
    axis = omega / np.linalg.norm(omega)
    expected = np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * axis])
    np.testing.assert_allclose(believed.imu_quat_wxyz, expected, atol=1e-6)
