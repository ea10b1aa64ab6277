"""What each foot bears: by the joints' torques, and by foot sensors that agree with them.

Foot sensors of real robots give raw counts with a scale, bias and drift of their own, fail for a
while, or give nothing at all. The torques of the joints always tell the force, though some
milliseconds late and with the error of friction in the joints. So the sensor's counts s are
regressed on the force f by torques, both filtered alike, with what is older than `memory_time`
forgotten: s = s̄ + c (f − f̄) with c = cov(s, f) / var(f). That uses stance and swing alike. What s
says of the load now, f̄ + (s − s̄) / c, counts as far as the two are correlated and while they
agree. A sensor that is absent, dead or not yet compared is not correlated, and does not count.
Real counts are held for some 20 ms: while one stays the same and the load by torques moves away
from what it says, it counts the less the further that has moved.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.controller.maths.leg_reaction import LegMotion, foot_forces, reaction_torques
from quadriga.agents.controller.maths.rows import places, row_size
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import N_JOINTS, N_LEGS, Array
from quadriga.shared.robots.spec import Geometry
from quadriga.shared.runtime.jit import compiled

_LEAST_SPREAD = 8.0  # N, standard deviation of the load from which on it shows a sensor's scale
_LEAST_COVARIANCE = 1e-6  # N · count; that of a sensor stuck at one count decays to nothing
_CORRELATED = (0.6, 0.9)  # squared correlation from which on a sensor counts, and counts fully
_AGREES = (20.0, 0.4)  # N and share of the load by which a sensor may differ from the torques
_PATIENCE = 0.008  # s for which it may differ by more: it shows a touchdown before torques do
_OLD = 5.0  # N by which the load moves away from a held count until that does not count
_OUTLIER = 0.1  # weight in the regression of what differs by more
_SURE = 2.0  # times a sensor's error by which it must exceed the least load of a contact
_MOST = 32768.0  # counts, of 16 bits
_RELEASE = 0.5  # of the load by torques that begins a contact: with less, it ends

Flags = NDArray[np.bool_]


class FootLoadRule(NamedTuple):
    """How loads are told.

    Attributes:
        fused: 1: by torques and sensors; 0: by sensors alone, which measure N.
        least_force: load by a sensor from which on a foot is loaded, N.
        least_torque_force: likewise by torques.
        filter_time: time constant of both filters of the forces by torques, s.
        memory_time: after which a comparison of sensor and torques is forgotten, s.
    """

    fused: float
    least_force: float
    least_torque_force: float
    filter_time: float
    memory_time: float


N_FOOT_LOAD_RULE: Final = len(FootLoadRule._fields)


def foot_load_rule(config: Config) -> FootLoadRule:
    """The rule that a configuration sets."""
    controller = config.controller
    return FootLoadRule(
        fused=float(controller.foot_load == "fused"),
        least_force=controller.contact_force,
        least_torque_force=controller.contact_torque_force,
        filter_time=1e-3 * controller.reaction_filter_ms,
        memory_time=controller.calibration_time,
    )


class FootLoadLayout(NamedTuple):
    """Where the row of what is remembered keeps what, legs FL FR RL RR.

    Attributes:
        ticks: steps so far.
        v_smooth: filtered joint rates, (12,), rad/s.
        torques, torques_smooth: once and twice filtered reaction torques, (12,), N·m.
        counts, counts_smooth: the same of the sensors' counts, (4,).
        age: time for which sensor and torques have been compared, (4,), s.
        mean_force, mean_counts: of the comparison, (4,), N and counts.
        var_force, var_counts, covariance: likewise, (4,).
        last_counts: the counts at the last tick, (4,).
        nearest: how near sensor and torques have come since they changed, (4,), N.
        differs: time for which a sensor has differed from the torques, (4,), s.
        by_torque: 1 where torques say that the foot is loaded, (4,).
        force: of the ground on each foot by torques, (12,), N, odometry frame.
    """

    ticks: int
    v_smooth: slice
    torques: slice
    torques_smooth: slice
    counts: slice
    counts_smooth: slice
    age: slice
    mean_force: slice
    mean_counts: slice
    var_force: slice
    var_counts: slice
    covariance: slice
    last_counts: slice
    nearest: slice
    differs: slice
    by_torque: slice
    force: slice


FOOT_LOAD: Final = FootLoadLayout(
    **places(
        ticks=1,
        v_smooth=N_JOINTS,
        torques=N_JOINTS,
        torques_smooth=N_JOINTS,
        counts=N_LEGS,
        counts_smooth=N_LEGS,
        age=N_LEGS,
        mean_force=N_LEGS,
        mean_counts=N_LEGS,
        var_force=N_LEGS,
        var_counts=N_LEGS,
        covariance=N_LEGS,
        last_counts=N_LEGS,
        nearest=N_LEGS,
        differs=N_LEGS,
        by_torque=N_LEGS,
        force=3 * N_LEGS,
    )
)
FOOT_LOAD_SIZE: Final = row_size(FOOT_LOAD)


class FootLoad(NamedTuple):
    """What each foot bears.

    Attributes:
        force: vertical force, (4,), N.
        loaded: whether that is enough to be a contact, (4,).
    """

    force: Array
    loaded: Flags


@compiled
def update_foot_load(
    memory: Array,
    motion: LegMotion,
    counts: Array,
    R: Array,
    links: Array,
    geometry: Geometry,
    rule: FootLoadRule,
    dt: float,
) -> FootLoad:
    """What each foot bears at this tick.

    Args:
        memory: see `FootLoadLayout`; changed in place.
        motion: of the legs, and their torques.
        counts: what the foot sensors measure, (4,).
        R: trunk to odometry frame, (3, 3).
        links: `link_table`.
        geometry: of the legs.
        rule: how loads are told.
        dt: time since the last tick, s.
    """
    if rule.fused < 0.5:
        return FootLoad(counts, counts >= rule.least_force)
    force = _force_by_torques(memory, motion, R, links, geometry, rule.filter_time, dt)
    if not np.isfinite(np.sum(force)):
        memory[:] = 0.0  # absurd readings would stay in the filters: all begins anew
        return FootLoad(np.zeros(4), np.zeros(4, dtype=np.bool_))
    counts = np.minimum(_MOST, np.maximum(-_MOST, counts))
    _smooth(memory, counts, dt / (rule.filter_time + dt))
    load, loaded = np.empty(4), np.empty(4, dtype=np.bool_)
    for leg in range(4):
        by_torque = force[leg, 2]
        _compare(memory, leg, by_torque, rule.memory_time, dt)
        sensed, error, weight = _by_sensor(memory, leg, by_torque, counts[leg], dt)
        load[leg] = max(0.0, by_torque + weight * (sensed - by_torque))
        carries = memory[FOOT_LOAD.by_torque][leg]
        least = rule.least_torque_force * (_RELEASE if carries > 0.5 else 1.0)
        memory[FOOT_LOAD.by_torque][leg] = 1.0 if by_torque >= least else 0.0
        shows = weight > 0.5 and sensed >= rule.least_force + _SURE * error
        loaded[leg] = by_torque >= least or shows
    memory[FOOT_LOAD.ticks] += 1.0
    return FootLoad(load, loaded)


@compiled
def _force_by_torques(
    memory: Array,
    motion: LegMotion,
    R: Array,
    links: Array,
    geometry: Geometry,
    filter_time: float,
    dt: float,
) -> Array:
    """Forces of the ground on the feet, late by two filters, (4, 3), N, odometry frame.

    The joints' accelerations are those of the filtered rates, (v − v̄) / T with v̄' = (v − v̄) / T;
    with h − τ filtered alike the sum is the residual of a momentum observer (De Luca, Mattone:
    Actuator failure detection and isolation using generalized momenta, 2003). Rates are noisy, so
    that it is filtered once more.
    """
    rate = dt / (filter_time + dt)
    v_smooth, once = memory[FOOT_LOAD.v_smooth], memory[FOOT_LOAD.torques]
    twice = memory[FOOT_LOAD.torques_smooth]
    begins = memory[FOOT_LOAD.ticks] < 0.5
    if begins:
        v_smooth[:] = motion.v_joint
    v_smooth += rate * (motion.v_joint - v_smooth)
    acceleration = (motion.v_joint - v_smooth) / filter_time
    static, inertial = reaction_torques(motion, acceleration, links)
    if begins:
        once[:], twice[:] = static, static
    once += rate * (static - once)
    twice += rate * (once + inertial - twice)
    force = memory[FOOT_LOAD.force].reshape(4, 3)
    in_trunk = foot_forces(twice, motion.q_joint, geometry)
    for leg in range(4):
        force[leg] = R @ in_trunk[leg]
    return force


@compiled
def _smooth(memory: Array, counts: Array, rate: float) -> None:
    """Filter the sensors' counts like the forces by torques."""
    once, twice = memory[FOOT_LOAD.counts], memory[FOOT_LOAD.counts_smooth]
    if memory[FOOT_LOAD.ticks] < 0.5:
        once[:], twice[:] = counts, counts
    once += rate * (counts - once)
    twice += rate * (once - twice)


@compiled
def _compare(memory: Array, leg: int, force: float, memory_time: float, dt: float) -> None:
    """Go on with the regression of a foot's counts on its load by torques."""
    weight = 1.0 if memory[FOOT_LOAD.differs][leg] < _PATIENCE else _OUTLIER
    memory[FOOT_LOAD.age][leg] = min(memory_time, memory[FOOT_LOAD.age][leg] + dt)
    rate = weight * dt / memory[FOOT_LOAD.age][leg]
    kept = 1.0 - rate
    by_force = force - memory[FOOT_LOAD.mean_force][leg]
    by_counts = memory[FOOT_LOAD.counts_smooth][leg] - memory[FOOT_LOAD.mean_counts][leg]
    memory[FOOT_LOAD.mean_force][leg] += rate * by_force
    memory[FOOT_LOAD.mean_counts][leg] += rate * by_counts
    var_force, var_counts = memory[FOOT_LOAD.var_force], memory[FOOT_LOAD.var_counts]
    covariance = memory[FOOT_LOAD.covariance]
    var_force[leg] = kept * (var_force[leg] + rate * by_force * by_force)
    var_counts[leg] = kept * (var_counts[leg] + rate * by_counts * by_counts)
    covariance[leg] = kept * (covariance[leg] + rate * by_force * by_counts)


@compiled
def _by_sensor(
    memory: Array, leg: int, force: float, counts: float, dt: float
) -> tuple[float, float, float]:
    """The load by a foot's sensor and its error, N, and how much it counts, 0 … 1.

    A 0 that is not what torques say is the reading of a sensor that fails, and never a touchdown.
    """
    var_force, var_counts = memory[FOOT_LOAD.var_force][leg], memory[FOOT_LOAD.var_counts][leg]
    covariance, differs = memory[FOOT_LOAD.covariance][leg], memory[FOOT_LOAD.differs]
    if var_force < _LEAST_SPREAD**2 or covariance < _LEAST_COVARIANCE:
        return 0.0, 0.0, 0.0
    correlation = covariance * covariance / (var_force * var_counts)
    least, full = _CORRELATED
    weight = min(1.0, max(0.0, (correlation - least) / (full - least)))
    scale = covariance / var_force
    sensed = (
        memory[FOOT_LOAD.mean_force][leg] + (counts - memory[FOOT_LOAD.mean_counts][leg]) / scale
    )
    away, nearest = abs(sensed - force), memory[FOOT_LOAD.nearest]
    is_new = counts != memory[FOOT_LOAD.last_counts][leg]
    memory[FOOT_LOAD.last_counts][leg] = counts
    nearest[leg] = away if is_new else min(nearest[leg], away)
    weight *= max(0.0, 1.0 - (away - nearest[leg]) / _OLD)
    far = away > _AGREES[0] + _AGREES[1] * abs(force)
    if far:
        failed = counts == 0.0
        differs[leg] = 2.0 * _PATIENCE if failed else min(2.0 * _PATIENCE, differs[leg] + dt)
    else:
        differs[leg] = max(0.0, differs[leg] - dt)
    error = np.sqrt(max(0.0, var_force * (1.0 / correlation - 1.0)))
    return sensed, error, weight if differs[leg] < _PATIENCE else 0.0
