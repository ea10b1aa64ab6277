"""Readings that fail: found, replaced for a moment, and a robot that stands instead of falling."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from quadriga.agents.validate import (
    AGREES_MS,
    HOLD_YOKED_MS,
    Validated,
    Validator,
    standing_torques,
)
from quadriga.identification.rollout import Rollout
from quadriga.shared.config.load import load
from quadriga.shared.messages import State
from quadriga.shared.robots.a1 import A1
from quadriga.shared.robots.conventions import GRAVITY, Array
from quadriga.team.operator import references_of
from tests.a1 import standing

DT = 1e-3
FAILS, BACK, END = 300, 800, 900  # ms
KNEE = 2
ALONE = load(None, {"team.robots": 1})
VALIDATOR = Validator(ALONE, 0)
Spoil = Callable[[State], State]


def moving(tick: int) -> State:
    """A robot that swings all joints as fast as a trot does, and rocks; its sensors are noisy."""
    noise, t = np.random.default_rng(tick).standard_normal(34), DT * tick
    roll, rate = 0.1 * np.sin(8.0 * t), 0.8 * np.cos(8.0 * t)
    return replace(
        standing(tick),
        q_joint=A1.q_stand + 0.3 * np.sin(25.0 * t) + 5e-4 * noise[:12],
        v_joint=7.5 * np.cos(25.0 * t) + 0.05 * noise[12:24],
        imu_quat_wxyz=np.array([np.cos(roll / 2), np.sin(roll / 2), 0.0, 0.0])
        + 1e-4 * noise[24:28],
        imu_gyro=np.array([rate, 0.0, 0.0]) + 0.01 * noise[28:31],
        imu_accel=GRAVITY * np.array([0.0, np.sin(roll), np.cos(roll)]) + 0.3 * noise[31:],
    )


def with_knee(state: State, q: float, v: float = 0.0) -> State:
    angles, rates = state.q_joint.copy(), state.v_joint.copy()
    angles[KNEE], rates[KNEE] = q, v
    return replace(state, q_joint=angles, v_joint=rates)


def with_imu(state: State, quat: Array, gyro: Array, accel: Array) -> State:
    return replace(state, imu_quat_wxyz=quat, imu_gyro=gyro, imu_accel=accel)


def random_quat(state: State) -> Array:
    quat = np.random.default_rng(state.tick).uniform(-1.0, 1.0, 4)
    return np.asarray(quat / np.linalg.norm(quat))


ZERO, OFF = np.zeros(3), np.zeros(4)
# What is wrong, and within how many milliseconds it is found.
OF_IMU: dict[str, tuple[Spoil, int]] = {
    "off": (lambda s: with_imu(s, OFF, ZERO, ZERO), 1),
    "garbage": (lambda s: with_imu(s, random_quat(s), s.imu_gyro, s.imu_accel), 1),
    "upside down": (lambda s: with_imu(s, s.imu_quat_wxyz, -s.imu_gyro, -s.imu_accel), 30),
    "no number": (lambda s: replace(s, imu_gyro=np.full(3, np.nan)), 1),
    "stuck": (lambda s: replace(moving(FAILS - 1), tick=s.tick), 22),
}
OF_KNEE: dict[str, tuple[Spoil, int]] = {
    "off": (lambda s: with_knee(s, 0.0), 1),
    "no number": (lambda s: with_knee(s, s.q_joint[KNEE], np.nan), 1),
    "jump": (lambda s: with_knee(s, s.q_joint[KNEE] + 0.2 * (-1) ** s.tick, s.v_joint[KNEE]), 1),
}


def follow(spoil: Spoil) -> list[tuple[State, Validated]]:
    """What was read, and what came of it, by tick."""
    memory, found = None, []
    for tick in range(END):
        state = spoil(moving(tick)) if FAILS <= tick < BACK else moving(tick)
        read = VALIDATOR.step(memory, state, DT)
        memory = read.memory
        found.append((state, read))
    return found


def test_sound_readings_pass_as_they_are() -> None:
    assert all(read.state is state and read.complete for state, read in follow(lambda s: s))
    memory = None
    for tick in range(500):  # one that stands still may read the same for long
        read = VALIDATOR.step(memory, standing(tick), DT)
        memory = read.memory
        assert read.complete


@pytest.mark.parametrize("fault", [*(f"imu {kind}" for kind in OF_IMU), *OF_KNEE])
def test_what_fails_is_held_then_lost_and_valid_again_once_it_agrees(fault: str) -> None:
    of_imu = fault.startswith("imu ")
    spoil, within = OF_IMU[fault.removeprefix("imu ")] if of_imu else OF_KNEE[fault]
    found = follow(spoil)
    seen = next(tick for tick, (_, read) in enumerate(found) if not read.complete)
    assert FAILS <= seen < FAILS + within
    for tick in range(seen, BACK):
        state, read = found[tick]
        lost = tick - seen >= 20
        assert (read.imu, read.encoders) == ((True, ()) if of_imu else (False, (KNEE,)))
        assert read.lost == (("imu-lost" if of_imu else "encoder-lost:FL_calf") if lost else "")
        if of_imu:
            last = found[seen - 1][0].imu_quat_wxyz
            np.testing.assert_allclose(read.state.imu_quat_wxyz, last / np.linalg.norm(last))
            assert not read.state.imu_gyro.any()
            assert np.linalg.norm(read.state.imu_accel) == pytest.approx(GRAVITY)
            np.testing.assert_array_equal(read.state.q_joint, state.q_joint)
        else:
            assert read.state.q_joint[KNEE] == found[seen - 1][0].q_joint[KNEE]
            assert read.state.v_joint[KNEE] == 0.0
            np.testing.assert_array_equal(read.state.imu_gyro, state.imu_gyro)
    sound = next(tick for tick in range(BACK, END) if found[tick][1].complete)
    # An IMU that said that gravity points upwards is filtered for as long again.
    assert AGREES_MS - 1 <= sound - BACK <= (6 * AGREES_MS if of_imu else AGREES_MS + 1)
    assert all(read.complete for _, read in found[sound:])


@pytest.mark.parametrize("accel", [157.0, 0.0], ids=["out of range", "silent"])
def test_gravity_takes_the_place_of_an_accelerometer(accel: float) -> None:
    for tick, (state, read) in enumerate(follow(lambda s: replace(s, imu_accel=np.full(3, accel)))):
        failed = FAILS <= tick < BACK + AGREES_MS - 1
        assert (read.imu, read.lost) == (failed, "")
        np.testing.assert_array_equal(read.state.imu_quat_wxyz, state.imu_quat_wxyz)
        if failed:
            assert np.linalg.norm(read.state.imu_accel) == pytest.approx(GRAVITY)


def test_without_any_reading_the_trunk_is_level_and_after_a_pause_a_joint_is_anywhere() -> None:
    read = VALIDATOR.step(None, with_imu(standing(0), OFF, ZERO, ZERO), DT)
    np.testing.assert_array_equal(read.state.imu_quat_wxyz, [1.0, 0.0, 0.0, 0.0])
    np.testing.assert_array_equal(read.state.imu_accel, [0.0, 0.0, GRAVITY])
    read = VALIDATOR.step(None, moving(0), DT)
    away = with_knee(moving(2000), A1.q_stand[KNEE] - 0.5)
    assert VALIDATOR.step(read.memory, away, 2.0).complete
    assert not VALIDATOR.step(read.memory, away, DT).complete


def test_a_motor_without_its_angle_bears_a_quarter_of_the_weight() -> None:
    _, thigh, calf = A1.q_stand[:3]
    lever = A1.geometry.link * abs(np.sin(thigh + calf))  # of a vertical force at the foot
    bears = lever * GRAVITY * A1.geometry.mass / 4.0
    assert abs(standing_torques(A1)[KNEE]) == pytest.approx(bears, rel=0.03)


@pytest.mark.parametrize("robots", [1, 2])
@pytest.mark.parametrize(
    "fault",
    [
        *(f"imu {kind} 2 0.5" for kind in ("off", "garbage", "wrong", "stuck")),
        "imu off 2",
        "encoder_FL_calf off 2",
        "encoder_RL_calf garbage 2 0.5",
        "imu off 2 0.01",
    ],
)
def test_a_robot_that_walks_stands_and_does_not_fall(fault: str, robots: int) -> None:
    given = {"team.robots": robots, "planner.kind": "none", "world.seed": 52}
    config = load(None, given | {"world.faults": f"r1/{fault}"})
    rollout = Rollout(config, None, references_of(config))
    modes = list[tuple[str, str]]()
    # Nobody here tells the other robot of the yoke to stand: it drags this one on. In real time it
    # stands within a second.
    dragged = robots > 1 and len(fault.split()) < 4
    for tick in rollout.ticks(2000 + HOLD_YOKED_MS + 1000 if dragged else 4500):
        mode = tick.outputs["r1"].mode, tick.outputs["r1"].reason
        if mode not in modes:
            modes.append(mode)
    lost = "imu-lost" if fault.startswith("imu") else f"encoder-lost:{fault[8:].split()[0]}"
    assert rollout.world.fallen() == ()
    assert tick.outputs["r1"].counters[f"{lost.partition('-')[0]}_invalid"] > 0
    # A moment stops nobody, and yokes keep a robot level meanwhile.
    brief = fault.endswith("0.01") or (robots > 1 and fault.endswith("0.5"))
    assert modes == [("stand", ""), ("walk", ""), *([] if brief else [("stand", lost)])]
