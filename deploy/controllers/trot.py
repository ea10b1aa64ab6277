"""A trot in fifty lines: stiff joints lead the feet, the IMU keeps the trunk level."""

import numpy as np

from quadriga.controller import build_command, read_task, serve

LEG, MASS = (ROBOT := read_task().config.robot).geometry, ROBOT.mass
SIDE = np.array([1.0, -1.0, 1.0, -1.0])  # of FL, FR, RL, RR
HIPS = np.stack([LEG.hip_x * np.array([1.0, 1.0, -1.0, -1.0]), LEG.hip_y * SIDE, np.zeros(4)], 1)
STANCE_S, LIFT = 0.2, 0.06  # of each stance, and of each swing; m, of a swinging foot
TILT_GAIN, TILT_RATE_S = 0.6, 0.04  # of standing legs, by which the trunk is levelled


def pose(seconds, stride, height, lift, tilt):
    """Angles of all joints, (12,); feet, (4, 3), m, under a level trunk; which of them stand."""
    phase = (seconds / STANCE_S + np.array([0.0, 1.0, 1.0, 0.0])) % 2.0
    stands, s = (phase < 1.0) | (lift == 0.0), phase % 1.0
    along = np.where(stands, 0.5 - s, s * s * (3.0 - 2.0 * s) - 0.5)
    feet = HIPS + np.stack([np.zeros(4), LEG.thigh_y * SIDE, np.zeros(4)], 1)
    feet[:, :2] += along[:, None] * stride
    feet[:, 2] = LEG.foot_radius - height + np.where(stands, 0.0, lift * np.sin(np.pi * s) ** 2)
    leaning = np.cross(tilt, feet)
    leaning[stands] *= [0.0, 0.0, -TILT_GAIN]  # push against it; swinging feet give way to it
    x, y, z = (feet - leaning - HIPS).T
    down = np.sqrt(np.maximum(y * y + z * z - LEG.thigh_y**2, 1e-4))  # in the plane of the leg
    calf = -np.arccos(np.clip((x * x + down * down) / (2.0 * LEG.link**2) - 1.0, -1.0, 1.0))
    hip = np.arctan2(z, y) - np.arctan2(-down, SIDE * LEG.thigh_y)
    q = np.stack([hip, np.arctan2(-x, down) - 0.5 * calf, calf], 1).ravel()
    return np.clip(q, ROBOT.lower, ROBOT.upper), feet, stands


def step(state, reference):
    w, x, y, z = state.imu_quat_wxyz
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1.0, 1.0))
    tilt = np.array([roll, pitch, 0.0]) + TILT_RATE_S * np.array([*state.imu_gyro[:2], 0.0])
    v = np.array([reference.vx, reference.vy]) + reference.wz * HIPS[:, 1::-1] * [-1.0, 1.0]
    asked = STANCE_S * v, reference.height, LIFT if np.abs(v).max() > 0.01 else 0.0, tilt
    q, _, _ = pose(1e-3 * state.tick, *asked)
    q_next, feet, stands = pose(1e-3 * state.tick + 1e-3, *asked)
    load = np.where(stands, MASS * 9.81 / max(stands.sum(), 1), 0.0)[:, None]  # N, on each foot
    x, y, _ = (feet - HIPS).T
    lever = np.stack([y, -x, LEG.link * np.sin(q[1::3] + q[2::3])], 1)
    v_des, tau = (q_next - q) / 1e-3, (-load * lever).ravel()
    limits = {"tau": np.clip(tau, -25.0, 25.0), "v_des": np.clip(v_des, -20.0, 20.0)}
    return build_command(state, q_des=q, kp=100.0, kd=2.5, **limits)


serve(step)
