"""What each foot is asked for: where swings begin, desired accelerations and forces."""

from __future__ import annotations

import numpy as np

from agents.controller import swing
from shared.jit import compiled
from shared.robot import Array


@compiled
def feet_demand(
    swing_start0: Array, foot_goal0: Array, contact: Array, stance: Array, progress: float,
    switched: bool, ground: Array, position: Array, velocity: Array, R: Array, p_foot: Array,
    J: Array, v: Array, v_des: Array, wz: float, deviation: Array, dt: float, constants: Array,
) -> Array:  # fmt: skip
    """New swing starts and foot goals, desired accelerations and forces, rows of (4, 4, 3)."""
    duration, raibert_gain, height, descent_speed, kp, kd, mass = constants
    swing_start, foot_goal = _feet_anchors(
        swing_start0, foot_goal0, p_foot, contact, stance, switched, descent_speed * dt
    )
    out = np.empty((4, 4, 3))
    out[0], out[1] = swing_start, foot_goal
    out[2] = _feet_acceleration(
        contact, stance, progress, swing_start, foot_goal, ground, position, velocity, R, p_foot,
        _foot_velocities(J, v, p_foot), v_des, wz, duration, raibert_gain, height, descent_speed,
        kp, kd,
    )  # fmt: skip
    out[3] = _desired_force(contact, deviation, R, mass)
    return out


@compiled
def _feet_anchors(
    swing_start: Array, foot_goal: Array, p_foot: Array, contact: Array, stance: Array,
    switched: bool, descent: float,
) -> tuple[Array, Array]:  # fmt: skip
    """Where swings begin and where unloaded stance feet are being lowered to, (4, 3) each."""
    start, goal = swing_start.copy(), foot_goal.copy()
    for leg in range(4):
        if switched and stance[leg] < 0.5:
            start[leg] = p_foot[leg]
        if contact[leg] > 0.5:
            goal[leg] = p_foot[leg]
        elif stance[leg] > 0.5:
            goal[leg, 2] -= descent
    return start, goal


@compiled
def _desired_force(contact: Array, deviation: Array, R: Array, mass: float) -> Array:
    """Nominal weight on the feet in contact plus the planned deviation, (4, 3), N."""
    count = max(1.0, np.sum(contact))
    norm = np.sqrt(R[0, 0] ** 2 + R[1, 0] ** 2)
    c, s = R[0, 0] / norm, R[1, 0] / norm
    force = np.zeros((4, 3))
    for leg in range(4):
        if contact[leg] > 0.5:
            dx, dy, dz = deviation[3 * leg], deviation[3 * leg + 1], deviation[3 * leg + 2]
            force[leg, 0] = c * dx - s * dy
            force[leg, 1] = s * dx + c * dy
            force[leg, 2] = mass * 9.81 / count + dz
    return force


@compiled
def _foot_velocities(J: Array, v: Array, p_foot: Array) -> Array:
    """Velocities of the foot centres, (4, 3), m/s, odometry frame."""
    out = np.empty((4, 3))
    for leg in range(4):
        twist = np.zeros(6)
        for k in range(9):
            column = k if k < 6 else 3 * leg + k
            for row in range(6):
                twist[row] += J[row, column] * v[column]
        p = p_foot[leg]
        out[leg, 0] = twist[0] + twist[4] * p[2] - twist[5] * p[1]
        out[leg, 1] = twist[1] + twist[5] * p[0] - twist[3] * p[2]
        out[leg, 2] = twist[2] + twist[3] * p[1] - twist[4] * p[0]
    return out


@compiled
def _feet_acceleration(
    contact: Array, stance: Array, progress: float, swing_start: Array, foot_goal: Array,
    ground: Array, position: Array, velocity: Array, R: Array, p_foot: Array, v_foot: Array,
    v_des: Array, wz: float, duration: float, raibert_gain: float, height: float,
    descent_speed: float, kp: float, kd: float,
) -> Array:  # fmt: skip
    """Desired accelerations of the feet not in contact, (4, 3), m/s²."""
    out = np.zeros((4, 3))
    expected = 0.0  # the ground at the foothold: what the feet now standing feel
    count = 0.0
    for leg in range(4):
        if stance[leg] > 0.5:
            expected += ground[leg]
            count += 1.0
    expected = expected / max(1.0, count)
    highest = np.max(ground)
    for leg in range(4):
        if contact[leg] > 0.5:
            continue
        reference = np.zeros((3, 3))
        if stance[leg] > 0.5:
            reference[0] = foot_goal[leg]
            reference[1, 2] = -descent_speed
        else:
            target = swing.foothold(
                leg, position, velocity, R, v_des, wz, (1.0 - progress) * duration, duration,
                raibert_gain,
            )  # fmt: skip
            reference = swing.swing_reference(
                swing_start[leg], target, expected, highest + height, progress, duration
            )
        out[leg] = (
            reference[2] + kp * (reference[0] - p_foot[leg]) + kd * (reference[1] - v_foot[leg])
        )
    return out
