"""The section of the simulated robots' sensors."""

from __future__ import annotations

from dataclasses import dataclass

from quadriga.shared.config.key import key


@dataclass(frozen=True, slots=True)
class SensorsConfig:
    """Noise and errors of the simulated sensors (standard deviations, where nothing else is said).

    What is drawn once is drawn for each robot, joint and foot from the world's seed. The defaults
    of accelerometer and feet are the A1's; other robots' records (`shared/robot`) have their own.
    """

    preset: str = key(
        "realistic",
        "-",
        "realistic, or ideal (noise and the biases of gyro and accelerometer alone; forces in N): "
        "replaces the defaults below",
        choices=("realistic", "ideal"),
    )
    joint_position: float = key(5e-4, "rad", "encoder noise", low=0.0, high=0.1)
    joint_offset: float = key(
        0.01, "rad", "error of each encoder's zero, drawn once", low=0.0, high=0.2
    )
    joint_velocity: float = key(0.05, "rad/s", "encoder rate noise", low=0.0, high=5.0)
    joint_torque: float = key(0.1, "N·m", "torque noise", low=0.0, high=10.0)
    gyro: float = key(0.01, "rad/s", "gyro noise", low=0.0, high=1.0)
    gyro_bias: float = key(0.002, "rad/s", "gyro bias, drawn once per run", low=0.0, high=1.0)
    accel: float = key(0.1, "m/s²", "accelerometer noise", low=0.0, high=10.0)
    accel_bias: float = key(0.15, "m/s²", "accelerometer bias, drawn once", low=0.0, high=5.0)
    orientation: float = key(1e-3, "rad", "IMU attitude noise", low=0.0, high=0.2)
    orientation_bias: float = key(
        0.01, "rad", "error of the IMU's roll and pitch, drawn once", low=0.0, high=0.2
    )
    yaw_drift: float = key(0.002, "rad/s", "drift of the IMU's yaw, drawn once", low=0.0, high=0.1)
    foot_sensor: str = key(
        "counts",
        "-",
        "what feet measure. counts: raw units with scale, offset, drift and dropouts, held and "
        "rounded to 16 bits; newtons: N, with noise, never negative; none: always 0",
        choices=("counts", "newtons", "none"),
    )
    foot_force: float = key(0.05, "N", "foot force noise", low=0.0, high=50.0)
    foot_scale: float = key(
        12.5, "1/N", "counts per N, the median of all feet", low=0.01, high=50.0
    )
    foot_scale_spread: float = key(
        0.06, "1", "of the logarithm of a foot's counts per N, drawn once", low=0.0, high=2.0
    )
    foot_offset: float = key(
        120.0, "1", "counts of an unloaded foot, the mean of all feet", low=-10_000.0, high=10_000.0
    )
    foot_bias: float = key(
        30.0, "1", "how far each foot's differ from that, drawn once", low=0.0, high=10_000.0
    )
    foot_drift: float = key(
        1.5, "1/√s", "random walk of that, counts after one second", low=0.0, high=1_000.0
    )
    foot_refresh_rate: float = key(
        49.0, "Hz", "how often counts are measured; in between they are held", low=1.0, high=1000.0
    )
    foot_dropout_rate: float = key(
        0.05,
        "1/s",
        "how often a foot's sensor fails for a while: it reads 0, or repeats its last value",
        low=0.0,
        high=100.0,
    )
    foot_dropout_ms: float = key(
        200.0, "ms", "how long a failure lasts on average", low=1.0, high=60_000.0
    )
