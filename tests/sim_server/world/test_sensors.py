from dataclasses import fields

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared.config.sections import SensorsConfig
from quadriga.shared.robot.conventions import Array
from quadriga.shared.wire.messages import State
from quadriga.sim_server.world.sensors import Sensors, turn_matrices
from tests.sim_server.standing import SILENT

CONFIG = SensorsConfig()
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
ARRAYS = [item.name for item in fields(State) if "shape" in item.metadata]


N_CHANNELS = 46  # joint angles, rates and torques, gyro, accelerometer, feet


def measure(sensors: Sensors, tick: int, channels: Array, quat: Array) -> dict[str, State]:
    """The messages of robots of which the sensors see `channels`, (n, 46)."""
    place = np.zeros((len(channels), 3))
    q = np.concatenate([place, quat, channels[:, :12]], axis=1)
    v = np.concatenate([place, channels[:, 36:39], channels[:, 12:24]], axis=1)
    tau, sensed = channels[:, 24:36].copy(), channels[:, 36:].copy()
    return sensors.measure(tick, q, v, tau, sensed)


def record(config: SensorsConfig, ticks: int, n: int = 1, seed: int = 0) -> dict[str, np.ndarray]:
    """Every field of the last robot's messages over time, for zero motion and 100 N per foot."""
    names = tuple(f"r{i + 1}" for i in range(n))
    sensors = Sensors(config, seed, names)
    channels = np.zeros((n, N_CHANNELS))
    channels[:, -4:] = 100.0
    quat = np.tile(LEVEL, (n, 1))
    states = [measure(sensors, tick, channels, quat)[names[-1]] for tick in range(ticks)]
    return {name: np.array([getattr(state, name) for state in states]) for name in ARRAYS}


def test_noise_has_the_configured_spread_and_no_memory() -> None:
    measured = record(CONFIG, 4000)
    for name, sigma in (
        ("q_joint", CONFIG.joint_position),
        ("v_joint", CONFIG.joint_velocity),
        ("tau_joint", CONFIG.joint_torque),
        ("imu_gyro", CONFIG.gyro),
        ("imu_accel", CONFIG.accel),
        ("foot_force", CONFIG.foot_force),
    ):
        noise = measured[name] - measured[name].mean(axis=0)
        np.testing.assert_allclose(noise.std(axis=0), sigma, rtol=0.06)
        correlation = (noise[1:] * noise[:-1]).mean(axis=0) / sigma**2
        assert np.abs(correlation).max() < 0.08
    for name in ("q_joint", "v_joint", "tau_joint"):
        assert np.abs(measured[name].mean(axis=0)).max() < 5.0 * measured[name].std() / 4000**0.5
    turns = 2.0 * measured["imu_quat_wxyz"][:, 1:]
    np.testing.assert_allclose(turns.std(axis=0), CONFIG.orientation, rtol=0.06)
    np.testing.assert_allclose(np.linalg.norm(measured["imu_quat_wxyz"], axis=1), 1.0)


def test_bias_is_drawn_once_per_run_and_robot() -> None:
    config = SensorsConfig(gyro=0.0, accel=0.0, gyro_bias=0.5, accel_bias=2.0)
    runs = [record(config, 70, seed=seed) for seed in range(60)]
    for name, sigma in (("imu_gyro", 0.5), ("imu_accel", 2.0)):
        for run in runs:
            np.testing.assert_array_equal(run[name], np.tile(run[name][0], (70, 1)))
        assert np.std([run[name][0] for run in runs]) == pytest.approx(sigma, rel=0.2)


def test_noise_of_a_robot_does_not_depend_on_the_others() -> None:
    names = ("r1", "r2", "r3")
    large, small = Sensors(CONFIG, 5, names), Sensors(CONFIG, 5, names[:2])
    random = np.random.default_rng(0)
    channels, quat = random.standard_normal((3, N_CHANNELS)), np.tile(LEVEL, (3, 1))
    for tick in range(130):
        a = measure(large, tick, channels, quat)["r2"]
        b = measure(small, tick, channels[:2], quat[:2])["r2"]
        for name in ARRAYS:
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    one, other = record(CONFIG, 1, n=1)["q_joint"], record(CONFIG, 1, n=2)["q_joint"]
    assert (one != other).all()


def test_without_noise_the_truth_passes_through() -> None:
    random = np.random.default_rng(1)
    channels = random.standard_normal((2, N_CHANNELS))
    channels[:, -4:] = np.abs(channels[:, -4:])
    quat = random.standard_normal((2, 4))
    quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    states = measure(Sensors(SILENT, 0, ("r1", "r2")), 7, channels, quat)
    for i, state in enumerate(states.values()):
        assert (state.tick, state.stamp_ns) == (7, 7_000_000)
        body = [state.q_joint, state.v_joint, state.tau_joint, state.imu_gyro, state.imu_accel]
        np.testing.assert_array_equal(np.concatenate([*body, state.foot_force]), channels[i])
        np.testing.assert_allclose(state.imu_quat_wxyz, quat[i], atol=1e-15)


def test_foot_force_is_never_negative() -> None:
    sensors = Sensors(SensorsConfig(foot_force=20.0), 0, ("r1",))
    zero, level = np.zeros((1, N_CHANNELS)), LEVEL[None]
    forces = np.array([measure(sensors, t, zero, level)["r1"].foot_force for t in range(200)])
    assert forces.min() == 0.0
    assert forces.max() > 20.0


def test_messages_keep_their_values_when_later_ones_are_made() -> None:
    sensors = Sensors(CONFIG, 0, ("r1",))
    zero, level = np.zeros((1, N_CHANNELS)), LEVEL[None]
    states = [measure(sensors, tick, zero, level)["r1"] for tick in range(200)]
    copies = [state.q_joint.copy() for state in states]
    for tick in range(200, 400):
        measure(sensors, tick, zero, level)
    for state, copy in zip(states, copies, strict=True):
        np.testing.assert_array_equal(state.q_joint, copy)
    assert len({copy.tobytes() for copy in copies}) == 200


@given(st.lists(st.floats(-0.2, 0.2), min_size=3, max_size=3), st.integers(0, 1000))
def test_turn_is_a_rotation_in_the_trunk_frame(vector: list[float], seed: int) -> None:
    quat = np.random.default_rng(seed).standard_normal(4)
    quat /= np.linalg.norm(quat)
    turned = turn_matrices(np.array(vector)) @ quat
    expected = pin.Quaternion(*quat).toRotationMatrix() @ pin.exp3(np.array(vector))
    np.testing.assert_allclose(pin.Quaternion(*turned).toRotationMatrix(), expected, atol=6e-3)
