"""What each foot is asked for: where swings begin, desired accelerations and forces."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from quadriga.agents.controller.maths.rotation import heading
from quadriga.agents.controller.memory import feet_memory_of, foot_goal_of, swing_start_of
from quadriga.agents.controller.schedule import GaitPhase
from quadriga.agents.controller.sensed import FeetState, TrunkState
from quadriga.agents.controller.swing import (
    MotionReference,
    foothold,
    limit_foothold,
    limit_inwards,
    swing_reference,
)
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import GRAVITY, Array, Leg
from quadriga.shared.runtime.jit import compiled

_SHORTEST = 0.1  # m, how near to the hip a foot is lifted
_CLEARANCE = 0.03  # m, how far a foot that was stopped still rises
_BACK = 0.3  # of the speed at which a foot rises in its reflex: away from what stopped it


class FeetGains(NamedTuple):
    """What feet are asked for.

    Attributes:
        stance_time: duration of the half cycle, s.
        raibert_gain: k of the foothold, s.
        foothold_inwards: greatest `MotionReference.inwards` without a load, m.
        swing_height: of a foot over the highest ground, m.
        descent_speed: at which a stance foot without ground is lowered, m/s.
        kp: of the feedback on a swing foot's position, 1/s².
        kd: of the feedback on its velocity, 1/s.
        delay: share of swing in which a foot rises before it goes forward.
        reflex_lift: speed at which a foot rises in its reflex, m/s.
        acceleration: greatest of a swing that began anew, m/s².
        track_sinking_trunk: 1 where feet are lowered as seen from a trunk that sinks, and lifted no
            nearer to the hip than legs reach; else 0.
        under_hip_x: where a foot stands at rest, from the trunk's origin, forwards, m.
        under_hip_y: likewise, outwards, m.
        foot_radius: m.
        reach: how far under the hip a foot is lowered, m.
    """

    stance_time: float
    raibert_gain: float
    foothold_inwards: float
    swing_height: float
    descent_speed: float
    kp: float
    kd: float
    delay: float
    reflex_lift: float
    acceleration: float
    track_sinking_trunk: float
    under_hip_x: float
    under_hip_y: float
    foot_radius: float
    reach: float


N_FEET_GAINS: Final = len(FeetGains._fields)


def feet_gains(config: Config) -> FeetGains:
    """The gains that a configuration sets, of its robot."""
    controller, robot = config.controller, config.robot
    under_hip_x, under_hip_y = robot.feet_under_hips[Leg.FL]
    return FeetGains(
        stance_time=1e-3 * config.gait.stance_ms,
        raibert_gain=controller.raibert_gain,
        foothold_inwards=controller.foothold_inwards,
        swing_height=controller.swing_height,
        descent_speed=controller.descent_speed,
        kp=controller.kp_swing,
        kd=controller.kd_swing,
        delay=controller.swing_delay,
        reflex_lift=controller.reflex_lift,
        acceleration=controller.swing_acceleration,
        track_sinking_trunk=float(controller.track_sinking_trunk),
        under_hip_x=float(under_hip_x),
        under_hip_y=float(under_hip_y),
        foot_radius=robot.geometry.foot_radius,
        reach=robot.reach,
    )


@compiled
def foot_velocities(J: Array, v: Array, p_foot: Array) -> Array:
    """Velocities of the foot centres, (4, 3), m/s, odometry frame.

    Args:
        J: spatial Jacobians, see `RigidBodyTerms`, (6, 18).
        v: generalised velocity, (18,).
        p_foot: foot centres, (4, 3), m, odometry frame.
    """
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
def update_anchors(
    memory: Array, phase: GaitPhase, trunk: TrunkState, p_foot: Array, gains: FeetGains, dt: float
) -> None:
    """Note where swings begin; lower the feet that shall stand and have no ground.

    With `track_sinking_trunk` they are lowered as seen from a trunk that sinks, as far as legs
    reach.

    Args:
        memory: `Memory.flat` of this tick; `swing_start` and `foot_goal` change.
        phase: of the gait.
        trunk: where it is and how it moves.
        p_foot: foot centres, (4, 3), m, odometry frame.
        gains: what feet are asked for.
        dt: time since the last tick, s.
    """
    descent, tracks = gains.descent_speed * dt, gains.track_sinking_trunk > 0.5
    start, goal = swing_start_of(memory), foot_goal_of(memory)
    feet_memory = feet_memory_of(memory)
    contact, early_contact = feet_memory.contact, feet_memory.early_contact
    lift = feet_memory.lift
    stance, progress, switched = phase
    for leg in range(4):
        stands = stance[leg] > 0.5
        if not stands and (switched or lift[leg] == progress):
            start[leg] = p_foot[leg]
        if contact[leg] > 0.5:
            goal[leg] = p_foot[leg]
        elif stands or early_contact[leg] > 0.5:
            if not tracks:
                goal[leg, 2] -= descent
                continue
            if switched and stands:
                goal[leg] = p_foot[leg]
            goal[leg, 2] -= descent - min(0.0, trunk.velocity[2]) * dt
            goal[leg, 2] = max(goal[leg, 2], trunk.position[2] - gains.reach)
        elif tracks:
            goal[leg] = p_foot[leg]


@compiled
def desired_forces(contact: Array, deviation: Array, R: Array, mass: float) -> Array:
    """Nominal weight on the feet in contact plus the planned deviation, (4, 3), N, odometry frame.

    Args:
        contact: 1 for the feet that may push, (4,).
        deviation: planned, from the nominal forces, (12,), N, yaw frame.
        R: trunk to odometry frame, (3, 3).
        mass: of robot and load, kg.
    """
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
def desired_accelerations(
    memory: Array,
    phase: GaitPhase,
    trunk: TrunkState,
    feet: FeetState,
    motion: MotionReference,
    gains: FeetGains,
) -> Array:
    """Desired accelerations of the feet not in contact, (4, 3), m/s², odometry frame.

    ẍ_des = ẍ_ref + kp (x_ref − x) + kd (ẋ_ref − ẋ)

    Args:
        memory: `Memory.flat` of this tick after `update_anchors`; `reaction` changes.
        phase: of the gait.
        trunk: where it is and how it moves.
        feet: where the feet are and how they move.
        motion: of the trunk, as footholds count on it.
        gains: what feet are asked for.
    """
    feet_memory = feet_memory_of(memory)
    contact, early_contact = feet_memory.contact, feet_memory.early_contact
    ground, lift = feet_memory.ground, feet_memory.lift
    reflex, reaction = feet_memory.reflex, feet_memory.reaction
    goal, start = foot_goal_of(memory), swing_start_of(memory)
    stance, progress = phase.stance, phase.progress
    p_foot, v_foot = feet.position, feet.velocity
    out = np.zeros((4, 3))
    levels = _expected_ground(stance, ground), np.max(ground)
    for leg in range(4):
        if contact[leg] > 0.5:
            reaction[leg] = 0.0
            continue
        position, velocity = p_foot[leg], v_foot[leg]
        reference = np.zeros((3, 3))
        if stance[leg] > 0.5 or early_contact[leg] > 0.5:
            reference[0] = goal[leg]
            reference[1, 2] = -gains.descent_speed
        elif reflex[leg] > 0.0:
            reference[0] = position
            reference[1] = _reflex_velocity(reaction[leg], gains.reflex_lift)
        else:
            reference = _swing(leg, start[leg], lift[leg], levels, progress, trunk, motion, gains)
        correction = gains.kp * (reference[0] - position) + gains.kd * (reference[1] - velocity)
        out[leg] = reference[2] + correction
        # What stops a foot that is to move with an acceleration a holds it back by −a.
        reaction[leg] = -correction
    return out


@compiled
def _expected_ground(stance: Array, ground: Array) -> float:
    """Height of the ground at a foothold: the mean under the feet that stand, m."""
    expected, count = 0.0, 0.0
    for leg in range(4):
        if stance[leg] > 0.5:
            expected += ground[leg]
            count += 1.0
    return expected / max(1.0, count)


@compiled
def _swing(
    leg: int,
    start: Array,
    lift: float,
    ground: tuple[float, float],
    progress: float,
    trunk: TrunkState,
    motion: MotionReference,
    gains: FeetGains,
) -> Array:
    """Reference of a swing foot, see `swing_reference`.

    Args:
        leg: which.
        start: where its swing began, (3,), m, odometry frame.
        lift: progress of the half cycle at which it began.
        ground: expected and highest height of the ground, m.
        progress: of the half cycle.
        trunk: where it is.
        motion: of the trunk, as footholds count on it.
        gains: what feet are asked for.
    """
    stance_time, k = gains.stance_time, gains.raibert_gain
    remaining = (1.0 - progress) * stance_time
    forwards = 1.0 if leg < 2 else -1.0
    outwards = 1.0 if leg % 2 == 0 else -1.0
    under_hip = forwards * gains.under_hip_x, outwards * gains.under_hip_y
    target = foothold(under_hip, trunk.position, trunk.R, motion, remaining, stance_time, k)
    limit_inwards(target, under_hip[1], trunk.position, trunk.R, motion.inwards)
    expected, highest = ground
    share = 1.0 - lift
    apex = highest + gains.swing_height
    if lift > 0.0:
        apex = max(apex, start[2] + _CLEARANCE)
        limit_foothold(target, start, gains.acceleration, share * stance_time, gains.delay)
    if gains.track_sinking_trunk > 0.5:
        apex = min(apex, max(trunk.position[2] - _SHORTEST, start[2]))
    return swing_reference(
        start,
        target,
        expected + gains.foot_radius,
        apex,
        (progress - lift) / share,
        share * stance_time,
        gains.delay,
    )


@compiled
def _reflex_velocity(reaction: Array, speed: float) -> Array:
    """Velocity of a foot in its reflex: up, and back from what stopped it in the plane. (3,)."""
    out = np.array([0.0, 0.0, speed])
    plane = np.sqrt(reaction[0] ** 2 + reaction[1] ** 2)
    if plane > 1e-6:
        out[0] = _BACK * speed * reaction[0] / plane
        out[1] = _BACK * speed * reaction[1] / plane
    return out
