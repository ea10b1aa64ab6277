from dataclasses import fields, replace

import numpy as np
import pinocchio as pin
import pytest

from quadriga.shared.config.load import load
from quadriga.shared.config.sections import SensorsConfig
from quadriga.shared.messages import State
from quadriga.shared.robots.conventions import Array
from quadriga.sim_server.world.sensors import Sensors
from tests.bridges.robots import real_go1_counts
from tests.sim_server.standing import SILENT

CONFIG = load(None, {"sensors.preset": "ideal"}).sensors
REAL = SensorsConfig()
# Feet that measure at every tick, never fail, and have no offset in common.
PLAIN = replace(REAL, foot_refresh_rate=1000.0, foot_dropout_rate=0.0, foot_offset=0.0)
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
ARRAYS = [item.name for item in fields(State) if "shape" in item.metadata]


N_CHANNELS = 46  # joint angles, rates and torques, gyro, accelerometer, feet


def measure(sensors: Sensors, tick: int, channels: Array, quat: Array) -> list[State]:
    """What robots say of which the sensors see `channels`, (n, 46)."""
    place = np.zeros((len(channels), 3))
    q = np.concatenate([place, quat, channels[:, :12]], axis=1)
    v = np.concatenate([place, channels[:, 36:39], channels[:, 12:24]], axis=1)
    tau, sensed = channels[:, 24:36].copy(), channels[:, 36:].copy()
    return [State.from_row(tick, 0, row) for row in sensors.measure(tick, q, v, tau, sensed)]


def attitudes(n: int) -> Array:
    """Random unit quaternions, (n, 4)."""
    quats: Array = np.random.default_rng(5).standard_normal((n, 4))
    quats /= np.linalg.norm(quats, axis=1, keepdims=True)
    return quats


def record(config: SensorsConfig, ticks: int, n: int = 1, seed: int = 0) -> dict[str, np.ndarray]:
    """Every field of the last robot's messages over time, for zero motion and 100 N per foot."""
    sensors = Sensors(config, seed, range(n))
    channels = np.zeros((n, N_CHANNELS))
    channels[:, -4:] = 100.0
    quat = np.tile(LEVEL, (n, 1))
    states = [measure(sensors, tick, channels, quat)[-1] for tick in range(ticks)]
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
    config = replace(CONFIG, gyro=0.0, accel=0.0, gyro_bias=0.5, accel_bias=2.0)
    runs = [record(config, 70, seed=seed) for seed in range(60)]
    for name, sigma in (("imu_gyro", 0.5), ("imu_accel", 2.0)):
        for run in runs:
            np.testing.assert_array_equal(run[name], np.tile(run[name][0], (70, 1)))
        assert np.std([run[name][0] for run in runs]) == pytest.approx(sigma, rel=0.2)


def test_noise_of_a_robot_does_not_depend_on_the_others() -> None:
    large, small = Sensors(CONFIG, 5, range(3)), Sensors(CONFIG, 5, range(2))
    random = np.random.default_rng(0)
    channels, quat = random.standard_normal((3, N_CHANNELS)), np.tile(LEVEL, (3, 1))
    for tick in range(130):
        a = measure(large, tick, channels, quat)[1]
        b = measure(small, tick, channels[:2], quat[:2])[1]
        for name in ARRAYS:
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    one, other = record(CONFIG, 1, n=1)["q_joint"], record(CONFIG, 1, n=2)["q_joint"]
    assert (one != other).all()


def test_without_noise_the_truth_passes_through() -> None:
    channels, quat = np.random.default_rng(1).standard_normal((2, N_CHANNELS)), attitudes(2)
    channels[:, -4:] = np.abs(channels[:, -4:])
    for i, state in enumerate(measure(Sensors(SILENT, 0, range(2)), 7, channels, quat)):
        body = [state.q_joint, state.v_joint, state.tau_joint, state.imu_gyro, state.imu_accel]
        np.testing.assert_array_equal(np.concatenate([*body, state.foot_force]), channels[i])
        np.testing.assert_allclose(state.imu_quat_wxyz, quat[i], atol=1e-15)


def counts_under(config: SensorsConfig, forces: Array, seed: int = 0) -> Array:
    """What a robot's feet read in ticks of these forces, (ticks, 4)."""
    sensors, channels = Sensors(config, seed, range(1)), np.zeros((1, N_CHANNELS))
    read = []
    for tick, force in enumerate(forces):
        channels[0, -4:] = force
        read.append(measure(sensors, tick, channels, LEVEL[None])[0].foot_force)
    return np.array(read)


def test_counts_are_whole_numbers_of_16_bits_and_may_be_negative() -> None:
    forces = np.random.default_rng(0).uniform(0.0, 200.0, (2000, 4))
    counts = counts_under(PLAIN, forces)
    np.testing.assert_array_equal(counts, np.rint(counts))
    assert counts.min() < 0.0
    wild = counts_under(PLAIN, np.array([[1e9, -1e9, 0.0, 0.0]]))
    assert wild.min() == -(2.0**15)
    assert wild.max() == 2.0**15 - 1


def test_every_foot_has_a_scale_and_a_bias_of_its_own() -> None:
    """A straight line fits what a foot reads; over many robots its numbers spread as configured."""
    config = replace(PLAIN, foot_drift=0.0, foot_force=0.0, foot_offset=500.0)
    forces = np.repeat([0.0, 1000.0], 2)[:, None] * np.ones(4)
    read = np.array([counts_under(config, forces, seed) for seed in range(150)])
    bias, scale = read[:, 0].ravel(), ((read[:, -1] - read[:, 0]) / 1000.0).ravel()
    assert np.median(scale) == pytest.approx(REAL.foot_scale, rel=0.1)
    assert np.log(scale).std() == pytest.approx(REAL.foot_scale_spread, rel=0.1)
    assert bias.std() == pytest.approx(REAL.foot_bias, rel=0.1)
    assert abs(bias.mean() - 500.0) < 4.0 * REAL.foot_bias / bias.size**0.5


def test_the_bias_walks_at_random() -> None:
    """Its variance grows in proportion to time."""
    config = replace(PLAIN, foot_force=0.0, foot_drift=30.0)
    quiet = np.zeros((1024, 4))
    walks = np.array([counts_under(config, quiet, seed) for seed in range(100)])
    for ticks in (256, 1023):
        spread = (walks[:, ticks] - walks[:, 0]).std()
        assert spread == pytest.approx(30.0 * (ticks / 1000.0) ** 0.5, rel=0.15)


def test_a_sensor_that_fails_reads_0_or_repeats_its_last_value() -> None:
    config = replace(PLAIN, foot_dropout_rate=0.5, foot_dropout_ms=100.0, foot_force=5.0)
    counts = counts_under(config, np.full((40_000, 4), 500.0))
    zero = counts == 0.0
    repeats = np.zeros_like(zero)
    repeats[8:] = (
        np.all([counts[8:] == counts[8 - k : -k] for k in range(1, 9)], axis=0) & ~zero[8:]
    )
    # A failure in 2 s of 0.1 s each: a twentieth of the time; half of it reads 0.
    for share in (zero.mean(), repeats.mean()):
        assert 0.01 < share < 0.045


def test_counts_are_held_as_those_of_a_real_go1() -> None:
    """All feet measure at once, 49 times a second; within the real ones' range while unloaded."""
    real = real_go1_counts()[::2]  # each for 4 ms
    config = load(None, {"team.robot": "go1", "sensors.foot_dropout_rate": 0.0}).sensors
    forces = np.maximum(0.0, np.repeat(real, 4, axis=0) - 120.0) / 12.5
    simulated = counts_under(config, forces)
    for counts, per_second in ((real, 250.0), (simulated, 1000.0)):
        changes = np.any(np.diff(counts, axis=0), axis=1)
        assert per_second * changes.mean() == pytest.approx(49.5, abs=1.0)
    assert np.quantile(simulated, 0.1) == pytest.approx(np.quantile(real, 0.1), abs=40.0)
    assert simulated.max() == pytest.approx(real.max(), rel=0.2)


def test_foot_sensors_that_cannot_pull_or_are_absent() -> None:
    newtons = counts_under(replace(CONFIG, foot_force=20.0), np.zeros((200, 4)))
    assert newtons.min() == 0.0
    assert newtons.max() > 20.0
    assert not counts_under(replace(REAL, foot_sensor="none"), np.full((100, 4), 80.0)).any()


def test_a_tilt_is_a_rotation_in_the_trunk_frame() -> None:
    for seed, quat in enumerate(attitudes(20)):
        sensors = Sensors(replace(SILENT, orientation_bias=0.1), seed, range(1))
        zero = np.zeros((1, N_CHANNELS))
        turned, level = (measure(sensors, t, zero, q[None])[0] for t, q in ((0, quat), (1, LEVEL)))
        R, tilt = (pin.Quaternion(*q).toRotationMatrix() for q in (quat, level.imu_quat_wxyz))
        found = pin.Quaternion(*turned.imu_quat_wxyz).toRotationMatrix()
        np.testing.assert_allclose(found, R @ tilt, atol=1e-12)
        x, y, z = 2.0 * level.imu_quat_wxyz[1:]
        assert 0.0 < np.hypot(x, y) < 0.6
        assert z == 0.0


def test_encoders_and_attitude_have_errors_that_stay() -> None:
    quiet = replace(REAL, joint_position=0.0, orientation=0.0)
    runs = [record(quiet, 3, seed=seed) for seed in range(80)]
    offsets = np.array([run["q_joint"] for run in runs])
    np.testing.assert_array_equal(offsets[:, 0], offsets[:, -1])
    assert offsets.std() == pytest.approx(REAL.joint_offset, rel=0.1)
    tilts = 2.0 * np.array([run["imu_quat_wxyz"][0, 1:] for run in runs])
    assert tilts[:, :2].std() == pytest.approx(REAL.orientation_bias, rel=0.2)
    np.testing.assert_allclose(tilts[:, 2], 0.0, atol=1e-12)  # of a yaw that has not drifted yet


def test_yaw_drifts_about_the_vertical_whatever_the_attitude() -> None:
    quiet = replace(SILENT, yaw_drift=0.1)
    (quat,) = attitudes(1)
    (measured,) = measure(Sensors(quiet, 0, range(1)), 2000, np.zeros((1, N_CHANNELS)), quat[None])
    R = pin.Quaternion(*quat).toRotationMatrix()
    turned = pin.Quaternion(*measured.imu_quat_wxyz).toRotationMatrix()
    turn = pin.log3(turned @ R.T)
    np.testing.assert_allclose(turn[:2], 0.0, atol=1e-12)
    assert abs(turn[2]) > 0.01


def test_errors_of_sensors_change_no_noise() -> None:
    """A robot's gyro and torques are the same numbers with ideal and with realistic sensors."""
    ideal, real = record(replace(CONFIG, accel_bias=REAL.accel_bias), 70), record(REAL, 70)
    for name in ("v_joint", "tau_joint", "imu_gyro", "imu_accel"):
        np.testing.assert_array_equal(ideal[name], real[name])
