"""What each foot is asked for: where swings begin, desired accelerations and forces."""

from __future__ import annotations

import numpy as np

from agents.controller import swing
from agents.controller.rotation import heading
from shared.jit import compiled
from shared.robot import GRAVITY, Array

_LONGEST = 0.37  # m, how far under the hip a foot is lowered; legs end at 0.4
_SHORTEST = 0.1  # m, how near to the hip a foot is lifted
_CLEARANCE = 0.03  # m, how far a foot that stumbled still rises
_BACK = 0.3  # of the speed at which a foot that stumbled rises: away from what stopped it


@compiled
def feet_demand(
    swing_start0: Array, foot_goal0: Array, contact: Array, stance: Array, progress: float,
    switched: bool, early: Array, lift: Array, stumble: Array, felt: Array, ground: Array,
    position: Array, velocity: Array, v_ahead: Array, R: Array, p_foot: Array, v_foot: Array,
    v_des: Array, wz: float, deviation: Array, dt: float, constants: Array, mass: float,
) -> Array:  # fmt: skip
    """New swing starts and foot goals, desired accelerations and forces, rows of (4, 4, 3).

    `lift`, `stumble` and `felt` are those of `Memory`; what each foot feels is updated in place.
    `v_ahead` is the velocity that footholds count on.
    """
    (duration, raibert_gain, height, descent_speed, kp, kd, delay, stumble_lift, nimble,
     follow_fall) = constants  # fmt: skip
    swing_start, foot_goal = _feet_anchors(
        swing_start0, foot_goal0, p_foot, contact, stance, switched, progress, early, lift,
        position, velocity, descent_speed * dt, dt, follow_fall > 0.5,
    )  # fmt: skip
    out = np.empty((4, 4, 3))
    out[0], out[1] = swing_start, foot_goal
    out[2] = _feet_acceleration(
        contact, stance, progress, early, lift, stumble, felt, swing_start, foot_goal, ground,
        position, v_ahead, R, p_foot, v_foot, v_des, wz, duration,
        raibert_gain, height, descent_speed, kp, kd, delay, stumble_lift, nimble,
        follow_fall > 0.5,
    )  # fmt: skip
    out[3] = _desired_force(contact, deviation, R, mass)
    return out


@compiled
def _feet_anchors(
    swing_start: Array, foot_goal: Array, p_foot: Array, contact: Array, stance: Array,
    switched: bool, progress: float, early: Array, lift: Array, position: Array, velocity: Array,
    descent: float, dt: float, follow_fall: bool,
) -> tuple[Array, Array]:  # fmt: skip
    """Where swings begin and where feet without ground are being lowered to, (4, 3) each.

    With `follow_fall` they are lowered as seen from a trunk that sinks, as far as legs reach.
    """
    start, goal = swing_start.copy(), foot_goal.copy()
    for leg in range(4):
        if stance[leg] < 0.5 and (switched or lift[leg] == progress):
            start[leg] = p_foot[leg]
        if contact[leg] > 0.5:
            goal[leg] = p_foot[leg]
        elif stance[leg] > 0.5 or early[leg] > 0.5:
            if not follow_fall:
                goal[leg, 2] -= descent
                continue
            if switched and stance[leg] > 0.5:
                goal[leg] = p_foot[leg]
            goal[leg, 2] -= descent - min(0.0, velocity[2]) * dt
            goal[leg, 2] = max(goal[leg, 2], position[2] - _LONGEST)
        elif follow_fall:
            goal[leg] = p_foot[leg]
    return start, goal


@compiled
def _desired_force(contact: Array, deviation: Array, R: Array, mass: float) -> Array:
    """Nominal weight on the feet in contact plus the planned deviation, (4, 3), N."""
    count = max(1.0, np.sum(contact))
    c, s = heading(R)
    force = np.zeros((4, 3))
    for leg in range(4):
        if contact[leg] > 0.5:
            dx, dy, dz = deviation[3 * leg], deviation[3 * leg + 1], deviation[3 * leg + 2]
            force[leg, 0] = c * dx - s * dy
            force[leg, 1] = s * dx + c * dy
            force[leg, 2] = mass * GRAVITY / count + dz
    return force


@compiled
def foot_velocities(J: Array, v: Array, p_foot: Array) -> Array:
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
    contact: Array, stance: Array, progress: float, early: Array, lift: Array, stumble: Array,
    felt: Array, swing_start: Array, foot_goal: Array, ground: Array, position: Array,
    velocity: Array, R: Array, p_foot: Array, v_foot: Array, v_des: Array, wz: float,
    duration: float, raibert_gain: float, height: float, descent_speed: float, kp: float,
    kd: float, delay: float, stumble_lift: float, nimble: float, in_reach: bool,
) -> Array:  # fmt: skip
    """Desired accelerations of the feet not in contact, (4, 3), m/s²; `felt` is updated."""
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
            felt[leg] = 0.0
            continue
        reference = np.zeros((3, 3))
        if stance[leg] > 0.5 or early[leg] > 0.5:
            reference[0] = foot_goal[leg]
            reference[1, 2] = -descent_speed
        elif stumble[leg] > 0.0:
            reference[0] = p_foot[leg]
            reference[1] = _away(felt[leg], stumble_lift)
        else:
            target = swing.foothold(
                leg, position, velocity, R, v_des, wz, (1.0 - progress) * duration, duration,
                raibert_gain,
            )  # fmt: skip
            left = 1.0 - lift[leg]
            apex = highest + height
            if lift[leg] > 0.0:
                apex = max(apex, swing_start[leg, 2] + _CLEARANCE)
                swing.within_reach(target, swing_start[leg], nimble, left * duration, delay)
            if in_reach:
                apex = min(apex, max(position[2] - _SHORTEST, swing_start[leg, 2]))
            reference = swing.swing_reference(
                swing_start[leg], target, expected, apex, (progress - lift[leg]) / left,
                left * duration, delay,
            )  # fmt: skip
        feedback = kp * (reference[0] - p_foot[leg]) + kd * (reference[1] - v_foot[leg])
        out[leg] = reference[2] + feedback
        # What stops a foot that is to move with an acceleration a holds it back by −a.
        felt[leg] = -feedback
    return out


@compiled
def _away(felt: Array, speed: float) -> Array:
    """Velocity at which a foot gives way: up, and back from what it feels in the plane. (3,)."""
    out = np.array([0.0, 0.0, speed])
    plane = np.sqrt(felt[0] ** 2 + felt[1] ** 2)
    if plane > 1e-6:
        out[0] = _BACK * speed * felt[0] / plane
        out[1] = _BACK * speed * felt[1] / plane
    return out
