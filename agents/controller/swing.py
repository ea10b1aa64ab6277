"""Swing feet: Raibert footholds, minimum jerk in the plane, a Bézier curve in height."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from quadriga.agents.controller.maths.rotation import heading
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.jit import compiled

_PLANE_DONE = 0.9  # of swing: the foot comes down vertically
_PENETRATION = 0.005  # m below the expected ground, so that touchdown is sure


class MotionReference(NamedTuple):
    """How the trunk moves and shall move, as footholds count on it.

    Attributes:
        v_expected: velocity to be expected until the foot has stood, (3,), m/s, odometry frame.
        v_des: desired velocity, (3,), m/s, odometry frame.
        wz: desired yaw rate, rad/s.
        inwards: how far from under its hip a foothold may lie towards the trunk's middle line, m.
    """

    v_expected: Array
    v_des: Array
    wz: float
    inwards: float


@compiled
def foothold(
    under_hip: tuple[float, float],
    position: Array,
    R: Array,
    motion: MotionReference,
    remaining: float,
    stance_time: float,
    gain: float,
) -> Array:
    """Raibert foothold p = p_hip + v·t_remaining + v·T_stance/2 + k (v − v_des). Shape (2,), m.

    v is the expected velocity; the hip's own velocity from the yaw rate is added to it.

    Args:
        under_hip: point of the trunk under which the foot stands at rest, m, trunk frame.
        position: of the trunk's origin, (3,), m, odometry frame.
        R: trunk to odometry frame, (3, 3).
        motion: of the trunk.
        remaining: time to touchdown, s.
        stance_time: T_stance, s.
        gain: k, s.
    """
    x, y = under_hip
    c, s = heading(R)
    rx, ry = c * x - s * y, s * x + c * y
    ahead = remaining + 0.5 * stance_time
    velocity, v_des, wz, _ = motion
    out = np.empty(2)
    out[0] = position[0] + rx + (velocity[0] - wz * ry) * ahead
    out[1] = position[1] + ry + (velocity[1] + wz * rx) * ahead
    out[0] += gain * (velocity[0] - v_des[0])
    out[1] += gain * (velocity[1] - v_des[1])
    return out


@compiled
def limit_inwards(target: Array, y: float, position: Array, R: Array, inwards: float) -> None:
    """Move a foothold `target`, (2,), m, outwards, unless it is near enough to under its hip.

    A trunk that is thrown aside asks for footholds across its middle line, where other legs are.

    Args:
        target: odometry frame; it changes.
        y: of the point under the hip, m, trunk frame.
        position: of the trunk's origin, (3,), m, odometry frame.
        R: trunk to odometry frame, (3, 3).
        inwards: how far it may be towards the trunk's middle line from under its hip, m.
    """
    c, s = heading(R)
    outwards = 1.0 if y > 0.0 else -1.0
    aside = c * (target[1] - position[1]) - s * (target[0] - position[0]) - y
    beyond = -inwards - outwards * aside
    if beyond > 0.0:
        target[0] -= s * outwards * beyond
        target[1] += c * outwards * beyond


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
