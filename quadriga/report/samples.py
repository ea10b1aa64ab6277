"""Every robot's sensors at 100 Hz, and what follows from them about its feet."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from quadriga.agents.estimator.kinematics import leg_kinematics
from quadriga.agents.gait import scheduled_stance
from quadriga.recordings.traces import Traces
from quadriga.recordings.truth import Ticks, stack, ticks_of
from quadriga.shared.codec import decode
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import MessageError
from quadriga.shared.messages import Measurement, State
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import N_FORCES, N_LEGS, Array, robot_names
from quadriga.shared.robots.spec import Geometry
from quadriga.shared.topics import MEASUREMENT, SAMPLE_MS, STATE, topic_of

_STALE_MS: Final = 100  # a stance reported longer ago than this is not that of now
_LOADED: Final = 10.0  # N of true force that is a contact
_RANGE: Final = (5.0, 95.0)  # percentiles of a foot sensor's counts: without load and with


@dataclass(frozen=True, slots=True)
class Samples:
    """One robot at 100 Hz; M samples.

    Attributes:
        tick: shape (M,), ms.
        tilt: angle of the trunk's z axis to the vertical by its IMU, shape (M,), rad.
        foot_force: by the foot sensors, shape (M, 4), counts; N where they measure that.
        foot_speed: horizontal speed of the point of each foot that would touch the ground, shape
            (M, 4), m/s; NaN where the trunk's velocity is not known.
        torque: greatest share of the torque limit among the joints, shape (M,).
        stance: scheduled stance as the agent reported it, shape (M, 4), bool; by the clock where
            it reported none.
        contact: shape (M, 4), bool; by true force, by the foot sensors without truth.
    """

    tick: Ticks
    tilt: Array
    foot_force: Array
    foot_speed: Array
    torque: Array
    stance: Any
    contact: Any


def read_samples(recording: Recording, traces: Traces) -> dict[str, Samples]:
    """One pass over a recording; what does not decode is passed over."""
    states: defaultdict[str, list[State]] = defaultdict(list)
    measured: defaultdict[str, list[Measurement]] = defaultdict(list)
    for entry in recording.entries({STATE.name, MEASUREMENT.name}):
        if entry.tick < 0 or entry.tick % SAMPLE_MS:
            continue
        topic, robot = topic_of(entry.key)
        try:
            if topic is STATE:
                states[robot].append(decode(entry.payload, State))
            else:
                measured[robot].append(decode(entry.payload, Measurement))
        except MessageError:
            continue
    return {
        robot: _build_samples(traces, index, states[robot], measured[robot])
        for index, robot in enumerate(robot_names(traces.config.team.robots))
    }


def _build_samples(
    traces: Traces, index: int, states: Sequence[State], measured: Sequence[Measurement]
) -> Samples:
    states = list({state.tick: state for state in sorted(states, key=lambda s: s.tick)}.values())
    tick = ticks_of(states)
    quat = stack(states, "imu_quat_wxyz", 4)
    force = stack(states, "foot_force", N_LEGS)
    stance = _look_up_newest(
        tick,
        ticks_of(measured),
        stack(measured, "stance", N_LEGS) > 0.5,
        scheduled_stance(traces.config, index, tick - SAMPLE_MS),
    )
    contact = contact_by_sensors(force, traces.config)
    truth, robot = traces.truth, traces.config.robot
    if len(truth.tick):
        contact = _look_up(tick, truth.tick, truth.grf[:, index, :, 2] > _LOADED, contact)
    _, x, y, _ = np.moveaxis(quat, -1, 0)
    return Samples(
        tick=tick,
        tilt=np.arccos(np.clip(1.0 - 2.0 * (x * x + y * y), -1.0, 1.0)),
        foot_force=force,
        foot_speed=_compute_foot_speed(states, _find_velocity(traces, index, tick), robot.geometry),
        torque=(np.abs(stack(states, "tau_joint", N_FORCES)) / robot.torque_limit).max(
            axis=1, initial=0.0
        ),
        stance=stance,
        contact=contact,
    )


def contact_by_sensors(force: Array, config: Config) -> Any:
    """Which feet bear load by their sensors alone, shape (M, 4), bool.

    Counts have no known scale: above the middle of what a sensor gave, its foot counts as loaded.
    """
    if config.feet_measure_newtons:
        return force > config.controller.contact_force
    if not len(force):
        return np.zeros_like(force, dtype=bool)
    least, most = np.percentile(force, _RANGE, axis=0)
    return force > 0.5 * (least + most)


def _find_velocity(traces: Traces, index: int, tick: Ticks) -> Array:
    """Forward and leftward velocity, true or else estimated. Shape (M, 2), m/s, NaN: unknown."""
    unknown = np.full((len(tick), 2), np.nan)
    measured = traces.measurements[traces.robots[index]]
    estimated: Array = _look_up(tick, measured.tick, measured.y[:, 1:3], unknown)
    if not len(traces.truth.tick):
        return estimated
    true: Array = _look_up(tick, traces.truth.tick, traces.truth.y[:, index, 1:3], estimated)
    return true


def _compute_foot_speed(states: Sequence[State], velocity: Array, geometry: Geometry) -> Array:
    """Horizontal speed of the lowest point of each foot. Shape (M, 4), m/s."""
    speed = np.zeros((len(states), N_LEGS))
    for k, state in enumerate(states):
        p_foot, v_foot, omega_calf = leg_kinematics(state.q_joint, state.v_joint, geometry)
        tilt = _compute_tilt_rotation(state.imu_quat_wxyz)
        down = tilt.T @ np.array([0.0, 0.0, -geometry.foot_radius])
        rolling = np.cross(omega_calf + state.imu_gyro, down)
        relative = (np.cross(state.imu_gyro, p_foot) + v_foot + rolling) @ tilt.T
        speed[k] = np.hypot(*(relative[:, :2] + velocity[k]).T)
    return speed


def _compute_tilt_rotation(quat_wxyz: Array) -> Array:
    """Trunk to yaw frame, R_y(pitch) R_x(roll). Shape (3, 3)."""
    w, x, y, z = quat_wxyz.tolist()
    sin_pitch = min(1.0, max(-1.0, 2 * (w * y - z * x)))
    cos_pitch = (1.0 - sin_pitch**2) ** 0.5
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    sr, cr = float(np.sin(roll)), float(np.cos(roll))
    return np.array(
        [
            [cos_pitch, sin_pitch * sr, sin_pitch * cr],
            [0.0, cr, -sr],
            [-sin_pitch, cos_pitch * sr, cos_pitch * cr],
        ]
    )


def _look_up(tick: Ticks, known: Ticks, values: Any, otherwise: Any) -> Any:
    """Values at the ticks that are known, `otherwise` at the others; first axis is time."""
    _, here, there = np.intersect1d(tick, known, return_indices=True)
    chosen = np.array(otherwise)
    chosen[here] = values[there]
    return chosen


def _look_up_newest(tick: Ticks, known: Ticks, values: Any, otherwise: Any) -> Any:
    """At each tick the newest value that is not too old, or else `otherwise`."""
    if not len(known):
        return otherwise
    order = np.argsort(known, kind="stable")
    at = order[np.maximum(np.searchsorted(known[order], tick, side="right") - 1, 0)]
    age = tick - known[at]
    fresh = (age >= 0) & (age <= _STALE_MS)
    return np.where(fresh[:, None], values[at], otherwise)


def find_slip(samples: Samples) -> Array:
    """Speed of each foot that should stand and does, of others 0. Shape (M, 4), m/s."""
    return np.where(samples.stance & samples.contact, np.nan_to_num(samples.foot_speed), 0.0)
