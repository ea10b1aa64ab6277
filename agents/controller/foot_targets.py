"""What each foot is asked for: where swings begin, desired accelerations and forces."""

from __future__ import annotations

import numpy as np

from quadriga.agents.controller import swing
from quadriga.agents.controller.maths.rotation import heading
from quadriga.agents.controller.memory import anchors_of, legs_of, swings_of
from quadriga.agents.controller.sensing import SWITCHED, feet_of, trunk_of
from quadriga.shared.config.sections import Config
from quadriga.shared.robot.a1 import GRAVITY, Array
from quadriga.shared.runtime.jit import compiled

_LONGEST = 0.37  # m, how far under the hip a foot is lowered; legs end at 0.4
_SHORTEST = 0.1  # m, how near to the hip a foot is lifted
_CLEARANCE = 0.03  # m, how far a foot that stumbled still rises
_BACK = 0.3  # of the speed at which a foot that stumbled rises: away from what stopped it


@compiled
def feet_demand(
    memory: Array,
    seen: Array,
    schedule: Array,
    v_foot: Array,
    v_ahead: Array,
    v_des: Array,
    wz: float,
    deviation: Array,
    mass: float,
    dt: float,
    constants: Array,
) -> tuple[Array, Array]:
    """Desired accelerations of the feet off the ground and desired forces of the others, (4, 3).

    Where swings begin, where feet are lowered to and what each foot feels change in `memory`.

    Args:
        memory: of this tick, see `Memory`.
        seen: at this tick, see `Sensed`.
        schedule: `Schedule.row`.
        v_foot: velocities of the feet, (4, 3), m/s, odometry frame.
        v_ahead: velocity that footholds count on, (3,), m/s, odometry frame.
        v_des: desired velocity, (3,), m/s, odometry frame.
        wz: desired yaw rate, rad/s.
        deviation: planned deviation from the nominal forces, (12,), N, yaw frame.
        mass: of robot and load, kg.
        dt: time since the last tick, s.
        constants: `feet_constants`.
    """
    _lower(memory, seen, schedule, dt, constants)
    acceleration = _feet_acceleration(memory, seen, schedule, v_foot, v_ahead, v_des, wz, constants)
    R = trunk_of(seen).R
    return acceleration, _desired_force(legs_of(memory)[0], deviation, R, mass)


def feet_constants(config: Config) -> Array:
    """What `feet_demand` needs of the configuration. Shape (10,)."""
    controller = config.controller
    return np.array(
        [
            1e-3 * config.gait.stance_ms,
            controller.raibert_gain,
            controller.swing_height,
            controller.descent_speed,
            controller.kp_swing,
            controller.kd_swing,
            controller.swing_delay,
            controller.reflex_lift,
            controller.swing_acceleration,
            float(controller.track_sinking_trunk),
        ]
    )


@compiled
def _lower(memory: Array, seen: Array, schedule: Array, dt: float, constants: Array) -> None:
    """Note where swings begin; lower the feet that shall stand and have no ground.

    With `track_sinking_trunk` they are lowered as seen from a trunk that sinks, as far as legs
    reach.
    """
    descent, track_sinking_trunk = constants[3] * dt, constants[9] > 0.5
    stance, progress, switched = schedule[0:4], schedule[4], seen[SWITCHED] > 0.5
    start, goal = anchors_of(memory)
    legs, lift = legs_of(memory), swings_of(memory).lift
    contact, early = legs[0], legs[1]
    trunk = trunk_of(seen)
    p_foot = feet_of(seen)
    for leg in range(4):
        if stance[leg] < 0.5 and (switched or lift[leg] == progress):
            start[leg] = p_foot[leg]
        if contact[leg] > 0.5:
            goal[leg] = p_foot[leg]
        elif stance[leg] > 0.5 or early[leg] > 0.5:
            if not track_sinking_trunk:
                goal[leg, 2] -= descent
                continue
            if switched and stance[leg] > 0.5:
                goal[leg] = p_foot[leg]
            goal[leg, 2] -= descent - min(0.0, trunk.velocity[2]) * dt
            goal[leg, 2] = max(goal[leg, 2], trunk.position[2] - _LONGEST)
        elif track_sinking_trunk:
            goal[leg] = p_foot[leg]


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
    memory: Array,
    seen: Array,
    schedule: Array,
    v_foot: Array,
    v_ahead: Array,
    v_des: Array,
    wz: float,
    constants: Array,
) -> Array:
    """Desired accelerations of the feet not in contact, (4, 3), m/s²; what they feel is updated."""
    (
        duration,
        raibert_gain,
        height,
        descent_speed,
        kp,
        kd,
        delay,
        reflex_lift,
        nimble,
        in_reach,
    ) = constants
    stance, progress = schedule[0:4], schedule[4]
    legs = legs_of(memory)
    contact, early, ground = legs[0], legs[1], legs[4]
    lift, stumble, felt = swings_of(memory)
    swing_start, foot_goal = anchors_of(memory)
    position, _, R, _ = trunk_of(seen)
    p_foot = feet_of(seen)
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
            reference[1] = _away(felt[leg], reflex_lift)
        else:
            target = swing.foothold(
                leg,
                position,
                v_ahead,
                R,
                v_des,
                wz,
                (1.0 - progress) * duration,
                duration,
                raibert_gain,
            )
            left = 1.0 - lift[leg]
            apex = highest + height
            if lift[leg] > 0.0:
                apex = max(apex, swing_start[leg, 2] + _CLEARANCE)
                swing.within_reach(target, swing_start[leg], nimble, left * duration, delay)
            if in_reach > 0.5:
                apex = min(apex, max(position[2] - _SHORTEST, swing_start[leg, 2]))
            reference = swing.swing_reference(
                swing_start[leg],
                target,
                expected,
                apex,
                (progress - lift[leg]) / left,
                left * duration,
                delay,
            )
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
