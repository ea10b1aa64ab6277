"""A trot in sixty lines: stiff joints lead the feet, the IMU keeps the trunk level.

quadriga walk --robots 1 --controller 'python deploy/controllers/trot.py'
"""

import numpy as np

from quadriga.controller import build_command, read_task, serve

LEG, MASS = (ROBOT := read_task().config.robot).geometry, ROBOT.mass
SIDE = np.array([1.0, -1.0, 1.0, -1.0])  # of FL, FR, RL, RR
HIPS = np.stack([LEG.hip_x * np.array([1.0, 1.0, -1.0, -1.0]), LEG.hip_y * SIDE, np.zeros(4)], 1)
STANCE_S = 0.2  # of each stance, and of each swing
LIFT = 0.06  # m, of a swinging foot
KP, KD = 100.0, 2.5  # N·m/rad, N·m·s/rad
TILT_GAIN, TILT_RATE_S = 0.6, 0.04  # of standing legs, by which the trunk is levelled


def pattern(seconds, stride, height, lift):
    """Feet under a level trunk at a time, (4, 3), m, trunk frame; and which of them stand."""
    phase = (seconds / STANCE_S + np.array([0.0, 1.0, 1.0, 0.0])) % 2.0
    stands, s = (phase < 1.0) | (lift == 0.0), phase % 1.0
    along = np.where(stands, 0.5 - s, s * s * (3.0 - 2.0 * s) - 0.5)
    feet = HIPS + np.stack([np.zeros(4), LEG.thigh_y * SIDE, np.zeros(4)], 1)
    feet[:, :2] += along[:, None] * stride
    feet[:, 2] = LEG.foot_radius - height + np.where(stands, 0.0, lift * np.sin(np.pi * s) ** 2)
    return feet, stands


def joints(feet):
    """Angles (4, 3) of hips, thighs and calves that put the feet there."""
    x, y, z = (feet - HIPS).T
    down = np.sqrt(np.maximum(y * y + z * z - LEG.thigh_y**2, 1e-4))  # in the plane of the leg
    calf = -np.arccos(np.clip((x * x + down * down) / (2.0 * LEG.link**2) - 1.0, -1.0, 1.0))
    hip = np.arctan2(z, y) - np.arctan2(-down, SIDE * LEG.thigh_y)
    return np.stack([hip, np.arctan2(-x, down) - 0.5 * calf, calf], 1)


def step(state, reference):
    w, x, y, z = state.imu_quat_wxyz
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1.0, 1.0))
    tilt = np.array([roll, pitch, 0.0]) + TILT_RATE_S * np.array([*state.imu_gyro[:2], 0.0])
    v = np.array([reference.vx, reference.vy]) + reference.wz * HIPS[:, 1::-1] * [-1.0, 1.0]
    lift = LIFT if np.abs(v).max() > 0.01 else 0.0
    q = []
    for ahead in (0.0, 1e-3):
        feet, stands = pattern(1e-3 * state.tick + ahead, STANCE_S * v, reference.height, lift)
        leaning = np.cross(tilt, feet)
        leaning[stands] *= [0.0, 0.0, -TILT_GAIN]  # push against it; swinging feet give way to it
        q.append(np.clip(joints(feet - leaning).ravel(), ROBOT.lower, ROBOT.upper))
    share = MASS * 9.81 / max(stands.sum(), 1)  # N, of the weight, on each standing leg
    load = np.where(stands, share, 0.0)[:, None]
    x, y, _ = (feet - HIPS).T
    lever = np.stack([y, -x, LEG.link * np.sin(q[0][1::3] + q[0][2::3])], 1)
    v_des = np.clip((q[1] - q[0]) / 1e-3, -20.0, 20.0)
    tau = np.clip((-load * lever).ravel(), -25.0, 25.0)
    return build_command(state, tau=tau, q_des=q[0], v_des=v_des, kp=KP, kd=KD)


if __name__ == "__main__":
    serve(step)
