"""What each foot is asked for: Raibert footholds, swing curves, retraction, forces in stance."""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.agents.estimator.kinematics import heading
from quadriga.shared.robots.conventions import GRAVITY, Array
from quadriga.shared.runtime.jit import compiled

_SHORTEST: Final = 0.1  # m, how near to the hip a foot is lifted
_CLEARANCE: Final = 0.03  # m, how far a foot that was stopped still rises
_RETRACTION_SPEED: Final = 1.0  # m/s, upwards, of a foot that was stopped
_BACK: Final = 0.3  # of that speed: away from what stopped it
_ACCELERATION: Final = 100.0  # m/s², the most that the way of a late swing may need
_PLANE_DONE: Final = 0.9  # of swing: the foot comes down vertically
_PENETRATION: Final = 0.005  # m below the expected ground, so that touchdown is sure


@compiled
def foot_velocities(J: Array, v: Array, p_foot: Array) -> Array:
    """Velocities of the foot centres, (4, 3), m/s, odometry frame, by `RigidBodyTerms.J`."""
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
def stance_forces(state: np.record, gains: np.record, deviation: Array) -> Array:
    """Nominal weight on the feet in contact plus the planned deviation, (4, 3), N, odometry frame.

    `deviation` is that from the nominal forces, (12,), N, yaw frame.
    """
    mass, count = gains.body_mass + state.payload, max(1.0, np.sum(state.contact))
    c, s = heading(state.R)
    force = np.zeros((4, 3))
    for leg in range(4):
        if state.contact[leg] > 0.5:
            dx, dy, dz = deviation[3 * leg], deviation[3 * leg + 1], deviation[3 * leg + 2]
            force[leg, 0] = c * dx - s * dy
            force[leg, 1] = s * dx + c * dy
            force[leg, 2] = mass * GRAVITY / count + dz
    return force


@compiled
def swing_accelerations(state: np.record, wz: float, gains: np.record) -> Array:
    """Desired accelerations of the feet not in contact, (4, 3), m/s², odometry frame.

    ẍ_des = ẍ_ref + kp (x_ref − x) + kd (ẋ_ref − ẋ); the desired yaw rate is `wz`, rad/s.
    """
    update_anchors(state, gains)
    out = np.zeros((4, 3))
    for leg in range(4):
        if state.contact[leg] > 0.5:
            state.reaction[leg] = 0.0
            continue
        position, velocity = state.p_foot[leg], state.v_foot[leg]
        reference = np.zeros((3, 3))
        if state.stance[leg] > 0.5 or state.early_contact[leg] > 0.5:
            reference[0] = state.foot_goal[leg]
            reference[1, 2] = -gains.descent_speed
        elif state.retraction[leg] > 0.0:
            reference[0] = position
            # Up, and back from what stopped it.
            reaction, reference[1, 2] = state.reaction[leg], _RETRACTION_SPEED
            plane = np.sqrt(reaction[0] ** 2 + reaction[1] ** 2)
            if plane > 1e-6:
                reference[1, :2] = _BACK * _RETRACTION_SPEED * reaction[:2] / plane
        else:
            reference = _swing(state, wz, gains, leg)
        correction = gains.kp_swing * (reference[0] - position)
        correction = correction + gains.kd_swing * (reference[1] - velocity)
        out[leg] = reference[2] + correction
        # What stops a foot that is to move with an acceleration a holds it back by −a.
        state.reaction[leg] = -correction
    return out


@compiled
def update_anchors(state: np.record, gains: np.record) -> None:
    """Note where swings begin; lower the feet that shall stand and have no ground.

    With `track_sinking_trunk` they are lowered as seen from a trunk that sinks, as far as legs
    reach.
    """
    descent, tracks = gains.descent_speed * state.dt, gains.track_sinking_trunk > 0.5
    goal, switched = state.foot_goal, state.switched > 0.5
    for leg in range(4):
        stands, p_foot = state.stance[leg] > 0.5, state.p_foot[leg]
        if not stands and (switched or state.lift[leg] == state.progress):
            state.swing_start[leg] = p_foot
        if state.contact[leg] > 0.5:
            goal[leg] = p_foot
        elif stands or state.early_contact[leg] > 0.5:
            if not tracks:
                goal[leg, 2] -= descent
                continue
            if switched and stands:
                goal[leg] = p_foot
            goal[leg, 2] -= descent - min(0.0, state.velocity[2]) * state.dt
            goal[leg, 2] = max(goal[leg, 2], state.position[2] - gains.reach)
        elif tracks:
            goal[leg] = p_foot


@compiled
def _swing(state: np.record, wz: float, gains: np.record, leg: int) -> Array:
    """Reference of a swing foot, see `swing_reference`."""
    expected, count = 0.0, 0.0  # the ground at a foothold: the mean under the feet that stand
    for other in range(4):
        if state.stance[other] > 0.5:
            expected += state.ground[other]
            count += 1.0
    expected /= max(1.0, count)
    start, lift = state.swing_start[leg], state.lift[leg]
    share = 1.0 - lift
    duration = share * gains.stance_time
    target = foothold(state, wz, gains, leg)
    apex = np.max(state.ground) + gains.swing_height
    if lift > 0.0:
        apex = max(apex, start[2] + _CLEARANCE)
        limit_foothold(target, start, _ACCELERATION, duration, gains.swing_delay)
    if gains.track_sinking_trunk > 0.5:
        apex = min(apex, max(state.position[2] - _SHORTEST, start[2]))
    ground, progress = expected + gains.foot_radius, (state.progress - lift) / share
    return swing_reference(start, target, ground, apex, progress, duration, gains.swing_delay)


@compiled
def foothold(state: np.record, wz: float, gains: np.record, leg: int) -> Array:
    """Raibert foothold p = p_hip + v·t_remaining + v·T_stance/2 + k (v − v_des). Shape (2,), m.

    v is the trunk's velocity; the hip's own velocity from the yaw rate is added to it. It lies no
    farther than `foothold_inwards` (times 1 + payload / mass) towards the trunk's middle line from
    under its hip: a trunk that is thrown aside asks for footholds where other legs are.
    """
    x = (1.0 if leg < 2 else -1.0) * gains.under_hip[0]
    outwards = 1.0 if leg % 2 == 0 else -1.0
    y = outwards * gains.under_hip[1]
    position, velocity, k = state.position, state.velocity, gains.raibert_gain
    c, s = heading(state.R)
    rx, ry = c * x - s * y, s * x + c * y
    ahead = (1.0 - state.progress) * gains.stance_time + 0.5 * gains.stance_time
    out = np.empty(2)
    out[0] = position[0] + rx + (velocity[0] - wz * ry) * ahead
    out[1] = position[1] + ry + (velocity[1] + wz * rx) * ahead
    out[0] += k * (velocity[0] - state.v_des[0])
    out[1] += k * (velocity[1] - state.v_des[1])
    mass = gains.body_mass + state.payload
    inwards = mass / gains.body_mass * gains.foothold_inwards
    aside = c * (out[1] - position[1]) - s * (out[0] - position[0]) - y
    beyond = -inwards - outwards * aside
    if beyond > 0.0:
        out[0] -= s * outwards * beyond
        out[1] += c * outwards * beyond
    return out


@compiled
def limit_foothold(
    target: Array, start: Array, acceleration: float, duration: float, delay: float
) -> None:
    """Shorten the way from `start` to the foothold `target`, (2,), to what can be done in time.

    Minimum jerk over a way d in a time T has the greatest acceleration 10 d / (√3 T²).
    `duration` and `delay` are those of `swing_reference`, which has less than the swing for it.
    """
    dx, dy = target[0] - start[0], target[1] - start[1]
    way = np.sqrt(dx * dx + dy * dy)
    forward = (_PLANE_DONE - delay) * duration
    longest = 0.1 * np.sqrt(3.0) * acceleration * forward * forward
    if way > longest:
        target[0] = start[0] + dx * longest / way
        target[1] = start[1] + dy * longest / way


@compiled
def swing_reference(
    start: Array,
    target: Array,
    ground: float,
    apex: float,
    progress: float,
    duration: float,
    delay: float,
) -> Array:
    """Reference of one swing foot's centre. Shape (3, 3): rows position, velocity, acceleration.

    Minimum jerk in the plane, a Bézier curve in height.

    Args:
        start: where the foot left the ground, (3,), m.
        target: foothold, (2,), m.
        ground: height of a foot's centre that stands on the expected ground, m.
        apex: height of the foot's centre at mid-swing, m.
        progress: progress of swing in [0, 1).
        duration: swing time, s.
        delay: share of it in which the foot rises before it goes forward.
    """
    out = np.zeros((3, 3))
    s = min(1.0, max(0.0, progress - delay) / (_PLANE_DONE - delay))
    rate = 1.0 / ((_PLANE_DONE - delay) * duration)
    jerk = s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
    slope = 30.0 * s * s * (1.0 - s) ** 2 * rate
    bend = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) * rate * rate
    for axis in range(2):
        step = target[axis] - start[axis]
        out[0, axis] = start[axis] + step * jerk
        out[1, axis] = step * slope
        out[2, axis] = step * bend
    # Bézier of degree five with doubled end points: zero vertical speed at both ends.
    end = ground - _PENETRATION
    middle = (32.0 * apex - 6.0 * start[2] - 6.0 * end) / 20.0
    points = np.array([start[2], start[2], middle, middle, end, end])
    for order in range(3):
        degree = 5 - order
        value, binomial = 0.0, 1.0
        for i in range(degree + 1):
            value += points[i] * binomial * progress**i * (1.0 - progress) ** (degree - i)
            binomial = binomial * (degree - i) / (i + 1)
        out[order, 2] = value
        for i in range(degree):
            points[i] = degree * (points[i + 1] - points[i]) / duration
    return out
