"""What each foot bears: by the joints' torques, and by foot sensors that agree with them.

Foot sensors of real robots give raw counts with a scale, bias and drift of their own, fail for a
while, or give nothing at all. The torques of the joints always tell the force, though some
milliseconds late and with the error of friction in the joints. So the sensor's counts s are
regressed on the force f by torques, both filtered alike, with what is older than `calibration_time`
forgotten: s = s̄ + c (f − f̄) with c = cov(s, f) / var(f). That uses stance and swing alike. What s
says of the load now, f̄ + (s − s̄) / c, counts as far as the two are correlated and while they
agree. A sensor that is absent, dead or not yet compared is not correlated, and does not count.
Real counts are held for some 20 ms: while one stays the same and the load by torques moves away
from what it says, it counts the less the further that has moved.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.agents.estimator.filter import specific_force_at_origin
from quadriga.agents.estimator.kinematics import rotation_matrix
from quadriga.agents.estimator.rigid_body import foot_forces, reaction_torques
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.jit import compiled

_FILTER_TIME: Final = 3e-3  # s, of both filters of the load by torques
_LEAST_TORQUE_FORCE: Final = 12.0  # N by torques, from which on a foot is in contact
_LEAST_SPREAD: Final = 8.0  # N, standard deviation of the load that shows a sensor's scale
_LEAST_COVARIANCE: Final = 1e-6  # N · count; that of a sensor stuck at one count decays to nothing
_CORRELATED: Final = (0.6, 0.9)  # squared correlation: a sensor counts from, and counts fully from
_AGREES: Final = (20.0, 0.4)  # N and share of the load by which a sensor may differ from torques
_PATIENCE: Final = 0.008  # s for which it may differ by more: it shows a touchdown before torques
_OLD: Final = 5.0  # N by which the load moves away from a held count until that does not count
_OUTLIER: Final = 0.1  # weight in the regression of what differs by more
_SURE: Final = 2.0  # times a sensor's error by which it must exceed the least load of a contact
_MOST: Final = 32768.0  # counts, of 16 bits
_RELEASE: Final = 0.5  # of the load by torques that begins a contact: with less, it ends


@compiled
def update_foot_load(state: np.record, gains: np.record) -> None:
    """Update `foot_force` and `foot_loaded`, and what is remembered for them."""
    force = _force_by_torques(state, gains)
    if not np.isfinite(np.sum(force)):
        forget_foot_load(state)  # absurd readings would stay in the filters: all begins anew
        return
    counts = np.minimum(_MOST, np.maximum(-_MOST, state.foot_counts))
    rate, once, twice = state.dt / (_FILTER_TIME + state.dt), state.counts, state.counts_smooth
    if state.load_ticks < 0.5:
        once[:], twice[:] = counts, counts
    once += rate * (counts - once)  # filtered like the forces by torques
    twice += rate * (once - twice)
    for leg in range(4):
        by_torque = force[leg, 2]
        _compare(state, leg, by_torque, gains.calibration_time)
        by_sensor, error, weight = _force_by_sensor(state, leg, by_torque, counts[leg])
        state.foot_force[leg] = max(0.0, by_torque + weight * (by_sensor - by_torque))
        carries = state.loaded_by_torque[leg] > 0.5
        least = _LEAST_TORQUE_FORCE * (_RELEASE if carries else 1.0)
        state.loaded_by_torque[leg] = 1.0 if by_torque >= least else 0.0
        shows = weight > 0.5 and by_sensor >= gains.contact_force + _SURE * error
        state.foot_loaded[leg] = 1.0 if by_torque >= least or shows else 0.0
    state.load_ticks += 1.0


@compiled
def forget_foot_load(state: np.record) -> None:
    """Begin anew: no load, and no sensor has been compared yet."""
    state.load_ticks = 0.0  # the filters begin with the next readings
    state.foot_force[:], state.foot_loaded[:], state.ground_force[:] = 0.0, 0.0, 0.0
    state.compared[:], state.mean_force[:], state.mean_counts[:] = 0.0, 0.0, 0.0
    state.var_force[:], state.var_counts[:], state.cov_counts[:] = 0.0, 0.0, 0.0
    state.last_counts[:], state.nearest[:], state.differs[:] = 0.0, 0.0, 0.0
    state.loaded_by_torque[:] = 0.0


@compiled
def _force_by_torques(state: np.record, gains: np.record) -> Array:
    """Forces of the ground on the feet, late by two filters, (4, 3), N, odometry frame.

    The joints' accelerations are those of the filtered rates, (v − v̄) / T with v̄' = (v − v̄) / T;
    with h − τ filtered alike the sum is the residual of a momentum observer (De Luca, Mattone:
    Actuator failure detection and isolation using generalized momenta, 2003). Rates are noisy, so
    that it is filtered once more.
    """
    rate, begins = state.dt / (_FILTER_TIME + state.dt), state.load_ticks < 0.5
    v_smooth, once, twice = state.v_smooth, state.torque, state.torque_smooth
    if begins:
        v_smooth[:] = state.v_joint
    v_smooth += rate * (state.v_joint - v_smooth)
    acceleration = (state.v_joint - v_smooth) / _FILTER_TIME
    specific_force = specific_force_at_origin(state.accel, state.omega, gains.imu)
    static, inertial = reaction_torques(state, acceleration, specific_force, gains.links)
    if begins:
        once[:], twice[:] = static, static
    once += rate * (static - once)
    twice += rate * (once + inertial - twice)
    R, in_trunk = rotation_matrix(state.quat_wxyz), foot_forces(twice, state.q_joint, gains)
    for leg in range(4):
        state.ground_force[leg] = R @ in_trunk[leg]
    force: Array = state.ground_force
    return force


@compiled
def _compare(state: np.record, leg: int, force: float, memory_time: float) -> None:
    """Go on with the regression of a foot's counts on its load by torques."""
    weight = 1.0 if state.differs[leg] < _PATIENCE else _OUTLIER
    state.compared[leg] = min(memory_time, state.compared[leg] + state.dt)
    rate = weight * state.dt / state.compared[leg]
    kept = 1.0 - rate
    by_force = force - state.mean_force[leg]
    by_counts = state.counts_smooth[leg] - state.mean_counts[leg]
    state.mean_force[leg] += rate * by_force
    state.mean_counts[leg] += rate * by_counts
    state.var_force[leg] = kept * (state.var_force[leg] + rate * by_force * by_force)
    state.var_counts[leg] = kept * (state.var_counts[leg] + rate * by_counts * by_counts)
    state.cov_counts[leg] = kept * (state.cov_counts[leg] + rate * by_force * by_counts)


@compiled
def _force_by_sensor(
    state: np.record, leg: int, force: float, counts: float
) -> tuple[float, float, float]:
    """The load by a foot's sensor and its error, N, and how much it counts, 0 … 1.

    A 0 that is not what torques say is the reading of a sensor that fails, and never a touchdown.
    """
    var_force, covariance, differs = state.var_force[leg], state.cov_counts[leg], state.differs
    if var_force < _LEAST_SPREAD**2 or covariance < _LEAST_COVARIANCE:
        return 0.0, 0.0, 0.0
    correlation = covariance * covariance / (var_force * state.var_counts[leg])
    least, full = _CORRELATED
    weight = min(1.0, max(0.0, (correlation - least) / (full - least)))
    scale = covariance / var_force
    by_sensor = state.mean_force[leg] + (counts - state.mean_counts[leg]) / scale
    away, nearest = abs(by_sensor - force), state.nearest
    is_new = counts != state.last_counts[leg]
    state.last_counts[leg] = counts
    nearest[leg] = away if is_new else min(nearest[leg], away)
    weight *= max(0.0, 1.0 - (away - nearest[leg]) / _OLD)
    if away > _AGREES[0] + _AGREES[1] * abs(force):
        failed = counts == 0.0
        differs[leg] = 2.0 * _PATIENCE if failed else min(2.0 * _PATIENCE, differs[leg] + state.dt)
    else:
        differs[leg] = max(0.0, differs[leg] - state.dt)
    error = np.sqrt(max(0.0, var_force * (1.0 / correlation - 1.0)))
    return by_sensor, error, weight if differs[leg] < _PATIENCE else 0.0
