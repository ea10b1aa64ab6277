"""Faults: their grammar, what each makes of a signal, and what a world does with them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared import codes
from quadriga.shared.codec import encode
from quadriga.shared.errors import ConfigError
from quadriga.shared.messages import Command, Event, State
from quadriga.shared.robots.conventions import Array
from quadriga.shared.robots.registry import ROBOTS
from quadriga.sim_server.world.faults import (
    KINDS,
    SPAN_MS,
    ComponentFault,
    Distortion,
    build_components,
    parse_faults,
)
from quadriga.sim_server.world.world import World
from tests.sim_server.standing import STAND, configured

NAMES, NAMED = ("r1", "r2"), ("imu", "motor_FL")
COMPONENTS = build_components(ROBOTS["a1"])
(GYRO,) = COMPONENTS["gyro"]
START, STOP = 100, 300


def test_a_fault_names_robot_component_kind_and_time() -> None:
    found = parse_faults("r2/imu stuck 4 0.5, r1/motor_FL off 0", NAMES, NAMED)
    assert found == (
        ComponentFault("r2", "imu", "stuck", 4000, 4500),
        ComponentFault("r1", "motor_FL", "off", 0, None),
    )
    assert parse_faults("", NAMES, NAMED) == ()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("r1/imu stuck", "robot/component kind start"),
        ("r1 imu stuck 4", "robot/component kind start"),
        ("r3/imu stuck 4", "robot 'r3'"),
        ("r1/imus stuck 4", "component 'imus'.*did you mean 'imu'"),
        ("r1/imu stack 4", "kind 'stack'.*did you mean 'stuck'"),
        ("r1/imu stuck -1", "start '-1'"),
        ("r1/imu stuck nan", "start 'nan'"),
        ("r1/imu stuck 4 0", "duration '0'"),
        ("r1/imu stuck 4,", "robot/component kind start"),
    ],
)
def test_a_wrong_fault_names_the_key_and_what_is_wrong(text: str, message: str) -> None:
    with pytest.raises(ConfigError, match=rf"^world\.faults: .*{message}"):
        parse_faults(text, NAMES, NAMED)


@pytest.mark.parametrize("kind", ROBOTS)
def test_parts_of_a_component_are_disjoint_and_within_its_message(kind: str) -> None:
    for name, parts in build_components(ROBOTS[kind]).items():
        columns = np.concatenate([part.columns for part in parts])
        sizes = {State: State.CUTS["foot_force"].stop, Command: Command.CUTS["kd"].stop}
        (message,) = {part.message for part in parts}
        assert len(set(columns)) == len(columns), name
        assert columns.min() >= 0
        assert columns.max() < sizes[message]
        for part in parts:
            assert part.low.shape == part.high.shape == part.columns.shape
            assert np.all(part.low <= part.high)
            assert part.wrong(np.linspace(0.1, 0.9, len(part.columns))).shape == part.columns.shape


def test_a_wrong_motor_gives_the_opposite_torque() -> None:
    (motor,) = build_components(ROBOTS["a1"])["motors"]
    row = np.random.default_rng(1).normal(size=60)
    wrong = row.copy()
    wrong[motor.columns] = motor.wrong(row[motor.columns])
    q, v = np.random.default_rng(2).normal(size=(2, 12))

    def torque(numbers: Array) -> Array:
        tau, q_des, v_des, kp, kd = numbers.reshape(5, 12)
        sum_: Array = tau + kp * (q_des - q) + kd * (v_des - v)
        return sum_

    np.testing.assert_allclose(torque(wrong), -torque(row), rtol=1e-12)


def test_a_wrong_attitude_is_a_unit_quaternion_tilted_by_its_angle() -> None:
    attitude, *_ = build_components(ROBOTS["a1"])["imu"]
    for quat in np.random.default_rng(3).normal(size=(20, 4)):
        sound = quat / np.linalg.norm(quat)
        wrong = attitude.wrong(sound)
        assert np.linalg.norm(wrong) == pytest.approx(1.0, abs=1e-12)
        assert 2.0 * np.arccos(abs(wrong @ sound)) == pytest.approx(0.2, abs=1e-9)


def run(kind: str, seed: int = 0) -> Array:
    """What a gyro says in 400 ticks whose sound values are tick, tick + 0.5 and −tick."""
    fault = ComponentFault("r1", "gyro", kind, START, STOP)
    distortion = Distortion(fault, GYRO, np.random.default_rng(seed))
    return np.array([distortion.distort(tick, sound(tick)) for tick in range(400)])


def sound(tick: int) -> Array:
    return np.array([tick, tick + 0.5, -tick], dtype=float)


SOUND = np.array([sound(tick) for tick in range(400)])
EXPECTED: dict[str, Callable[[int], Array]] = {
    "off": lambda _tick: np.zeros(3),
    "stuck": lambda _tick: sound(START - 1),
    "wrong": lambda tick: -sound(tick),
    "slow": lambda tick: sound(START + (tick - START) // SPAN_MS * SPAN_MS),
    "delayed": lambda tick: sound(tick - SPAN_MS),
}


@pytest.mark.parametrize("kind", KINDS)
def test_what_a_fault_makes_of_a_signal_and_nothing_before_and_after(kind: str) -> None:
    values = run(kind)
    np.testing.assert_array_equal(values[:START], SOUND[:START])
    np.testing.assert_array_equal(values[STOP:], SOUND[STOP:])
    if kind in EXPECTED:
        expected = np.array([EXPECTED[kind](tick) for tick in range(START, STOP)])
        np.testing.assert_array_equal(values[START:STOP], expected)


def test_garbage_fills_the_range_and_is_drawn_from_the_seed() -> None:
    values = run("garbage")[START:STOP]
    assert np.all((GYRO.low <= values) & (values <= GYRO.high))
    assert np.all(values.std(axis=0) > 0.4 * GYRO.high)
    np.testing.assert_array_equal(values, run("garbage")[START:STOP])
    assert not np.array_equal(values, run("garbage", seed=1)[START:STOP])


def test_intermittent_is_off_for_whole_spans() -> None:
    shares = []
    for seed in range(50):
        off = np.all(run("intermittent", seed)[START:STOP] == 0.0, axis=1)
        spans = off.reshape(-1, SPAN_MS)
        assert np.all(spans == spans[:, :1])
        shares.append(spans[:, 0].mean())
    assert 0.35 < np.mean(shares) < 0.65  # 200 spans: four standard deviations are 0.14


@given(
    kind=st.sampled_from(list(KINDS)),
    name=st.sampled_from(list(COMPONENTS)),
    seed=st.integers(0, 99),
)
def test_numbers_stay_finite_and_orientations_of_unit_length(
    kind: str, name: str, seed: int
) -> None:
    random = np.random.default_rng(seed)
    for component in COMPONENTS[name]:
        distortion = Distortion(ComponentFault("r1", name, kind, 2), component, random)
        for tick in range(60):
            values = random.normal(size=len(component.columns))
            if component.unit_length:
                values /= np.linalg.norm(values)
            found = distortion.distort(tick, values)
            assert np.all(np.isfinite(found))
            if component.unit_length and kind not in ("off", "intermittent"):
                assert np.linalg.norm(found) == pytest.approx(1.0)


def states_of(world: World, ticks: int) -> tuple[list[dict[str, State]], list[Event]]:
    states, events = [world.states()], list[Event]()
    for _ in range(ticks):
        events += world.step({name: STAND for name in world.names})
        states.append(world.states())
    return states, events


def test_a_faulty_sensor_lies_and_the_truth_does_not() -> None:
    config = configured(2, faults="r2/accel stuck 0.1 0.05", noise=True)
    faulty, events = states_of(World(config), 200)
    sound, _ = states_of(World(configured(2, noise=True)), 200)
    for tick in range(201):
        assert encode(faulty[tick]["r1"]) == encode(sound[tick]["r1"])
        if 100 <= tick < 150:
            np.testing.assert_array_equal(faulty[tick]["r2"].imu_accel, sound[99]["r2"].imu_accel)
            np.testing.assert_array_equal(faulty[tick]["r2"].imu_gyro, sound[tick]["r2"].imu_gyro)
        else:
            assert encode(faulty[tick]["r2"]) == encode(sound[tick]["r2"])
    told = [(e.tick, e.code, e.robot, e.detail) for e in events if e.kind == "fault"]
    assert told == [
        (100, codes.FAULT_BEGINS, "r2", "accel stuck"),
        (150, codes.FAULT_ENDS, "r2", "accel sound again"),
    ]


def test_a_motor_that_is_off_gives_no_torque_and_the_others_theirs() -> None:
    world = World(configured(1, faults="r1/motor_FL_calf off 0.1"))
    states_of(world, 150)
    torque = world.motors.torque[0]
    assert torque[2] == 0.0
    assert np.all(torque[[5, 8, 11]] > 3.0)  # the other knees carry the trunk


def test_a_robot_in_a_world_of_its_own_has_its_own_faults() -> None:
    config = configured(2, faults="r2/feet off 0, r1/gyro off 0")
    world = World(config, names=("r2",))
    states, events = states_of(world, 60)
    assert np.all(states[-1]["r2"].foot_force == 0.0)
    assert np.any(states[-1]["r2"].imu_gyro != 0.0)
    assert {event.robot for event in events if event.kind == "fault"} == {"r2"}


@pytest.mark.parametrize("kind", ["stuck", "garbage", "delayed", "off"])
def test_a_fault_that_is_asked_for_is_the_same_as_one_that_was_known_from_the_start(
    kind: str,
) -> None:
    config = configured(2, noise=True, live_faults=True)
    world, known = World(config), World(configured(2, noise=True, faults=f"r2/imu {kind} 0.1 0.05"))
    before, _ = states_of(world, 40)
    told = world.inject(f"r2/imu {kind} 0.05")
    assert [(e.tick, e.code, e.detail) for e in told] == [
        (40, codes.FAULT_ASKED, f"r2/imu {kind} 0.100 0.05")
    ]
    after, events = states_of(world, 160)
    expected, announced = states_of(known, 200)
    for one, other in zip([*before, *after[1:]], expected, strict=True):
        assert encode(one["r2"]) == encode(other["r2"])
    assert [e for e in events if e.kind == "fault"] == [e for e in announced if e.kind == "fault"]


@pytest.mark.parametrize("fault", ["r1/imu", "r1/imu off 1 2", "r9/imu off", "r1/imu of", "r1 imu"])
def test_a_fault_that_there_cannot_be_or_that_the_world_does_not_permit_is_refused(
    fault: str,
) -> None:
    with pytest.raises(ConfigError):
        World(configured(1, live_faults=True)).inject(fault)
    with pytest.raises(ConfigError, match=r"world\.live_faults = true"):
        World(configured(1)).inject("r1/imu off")
    with pytest.raises(ConfigError, match=r"^world\.faults"):
        World(configured(1, faults="r1/nose stuck 1"))
