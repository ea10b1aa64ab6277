"""Measures the figures that a predictor must reach before a team may walk with it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import linalg

from quadriga.agents.planner.best_response import iteration_radius, probe_costs, radius_limit
from quadriga.agents.planner.cooperation import cost_of
from quadriga.agents.planner.peers_gate import peers_figures
from quadriga.agents.predictor.episode import Y_SCALE, Episode
from quadriga.agents.predictor.gate_report import GateReport
from quadriga.agents.predictor.held_out import predict_windows, window_phases
from quadriga.agents.predictor.predictor import Predictor
from quadriga.agents.predictor.regression import scaled_blocks
from quadriga.agents.time_grid import horizon_stance, phase_of, walking_steps
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError
from quadriga.shared.robot.conventions import N_LEGS, N_OUTPUTS, OUTPUTS, Array
from quadriga.shared.wire.topics import SAMPLE_MS

_GAIN_FORCE = 10.0  # N, on the robot looked at
_GAIN_TIMES = (0.1, 0.25)  # s


def run_gates(config: Config, predictor: Predictor, held_out: Sequence[Episode]) -> GateReport:
    """Measure the figures of a predictor; `GateReport.check` compares them with their limits.

    Args:
        config: team, gait, controller and limits.
        predictor: whose figures are measured.
        held_out: episodes that the fit has not seen.

    Raises:
        PredictorError: no held-out episode is long enough.
    """
    windows, rmse, persistence, error = held_out_error(predictor, held_out)
    return GateReport(
        windows=windows,
        rmse=dict(zip(OUTPUTS, rmse, strict=True)),
        rmse_persistence=dict(zip(OUTPUTS, persistence, strict=True)),
        error=error,
        gain_times=_GAIN_TIMES,
        gains=tuple(tuple(row) for row in height_gains(config, predictor).tolist()),
        gain_limits=tuple(config.identification.gain_range),
        radius=iteration_radius(config, predictor),
        radius_limit=radius_limit(config),
        cost=cost_of(config),
        Q=tuple(config.planner.Q),
        R=tuple(config.planner.R),
        condition=predictor.condition,
        coupling=tuple(tuple(row) for row in coupling_table(predictor).tolist()),
        size=predictor.nbytes,
        cost_probes=probe_costs(config, predictor),
        peers=peers_figures(predictor, held_out, config.identification.max_peers_harm),
    )


def held_out_error(
    predictor: Predictor, held_out: Sequence[Episode]
) -> tuple[int, list[float], list[float], float]:
    """Number of windows, RMSE per output, RMSE of persistence, and the ratio of scaled errors.

    Persistence holds the last measured output y, not its deviation.
    """
    T_ini, N = predictor.meta.T_ini, predictor.meta.N
    length = T_ini + N
    squares, naive, count = np.zeros(N_OUTPUTS), np.zeros(N_OUTPUTS), 0
    for episode in held_out:
        if episode.samples < length:
            continue
        z, dy = episode.windows(T_ini, N)
        n, _, windows = dy.shape
        predicted = predict_windows(predictor, window_phases(predictor, episode, windows), z)
        error = (predicted - dy).reshape(n, N, N_OUTPUTS, windows)
        squares += (error**2).sum(axis=(0, 1, 3))
        for start in range(windows):
            future = episode.y[start + T_ini : start + length]
            naive += ((future - episode.y[start + T_ini - 1]) ** 2).sum(axis=(0, 1))
        count += windows
    if count == 0:
        raise PredictorError(
            "held-out data",
            "no episode that long",
            f"at least {length} samples",
            "did every held-out walk end in a fall?",
        )
    total = count * N * predictor.meta.robots
    rmse, persistence = np.sqrt(squares / total), np.sqrt(naive / total)
    ratio = np.linalg.norm(rmse / Y_SCALE) / np.linalg.norm(persistence / Y_SCALE)
    return count, rmse.tolist(), persistence.tolist(), float(ratio)


def coupling_table(predictor: Predictor) -> Array:
    """Frobenius norms of the blocks G_ij of the scaled predictor, largest phase. Shape (n, n)."""
    robots, layout = range(predictor.meta.robots), predictor.meta.layout
    norms = [
        [
            [np.linalg.norm(scaled_blocks(predictor.block(i, j, phase), layout)) for j in robots]
            for i in robots
        ]
        for phase in range(predictor.phases)
    ]
    table: Array = np.max(norms, axis=0)
    return table


def height_gains(config: Config, predictor: Predictor) -> Array:
    """Predicted over physical height response to a vertical force on one robot's stance feet.

    Each gain is averaged over the stance patterns of a phase; among the phases the one farthest
    from 1 counts. Shape (n, 2): robot, time of `_GAIN_TIMES`.
    """
    N, n = predictor.meta.N, predictor.meta.robots
    physical = physical_height(config, predictor.meta.interface, N)
    rows = [min(round(1000 * time / SAMPLE_MS), N) - 1 for time in _GAIN_TIMES]
    by_phase: dict[int, list[int]] = {}
    for step in walking_steps(config):
        by_phase.setdefault(phase_of(config, step, predictor.phases), []).append(step)
    gains = np.empty((len(by_phase), n, len(rows)))
    for k, (phase, steps) in enumerate(by_phase.items()):
        for robot in range(n):
            patterns = np.array([horizon_stance(config, robot, step) for step in steps])
            share = (patterns / patterns.sum(axis=2, keepdims=True)).mean(axis=0)
            du = np.zeros((N, N_LEGS, 3))
            du[:, :, 2] = _GAIN_FORCE * share
            z = (predictor.future_block(robot, robot, phase) @ du.ravel()).reshape(N, N_OUTPUTS)[
                :, 0
            ]
            gains[k, robot] = z[rows] / physical[rows]
    worst = np.abs(gains - 1.0).argmax(axis=0)
    greatest: Array = np.take_along_axis(gains, worst[None], axis=0)[0]
    return greatest


def physical_height(config: Config, interface: str, N: int) -> Array:
    """Height response to the test force at the ends of N samples. Shape (N,), m.

    The low level closes its loop on the height, a = −kp z − kd z' − ki ∫z. "feedforward" adds
    the force to it, z'' = F/m + a. With "force" the whole-body QP weighs the force it is asked
    for against a: on two stance legs γ₂/2·|f − f_des|² + γ₃/2·(z'' − a)² is least at
    z'' = α F/m + (1 − α) a with α = 1/(1 + 2 γ₃/(γ₂ m²)).
    """
    controller, mass = config.controller, config.robot.mass
    passed = 1.0
    share = 1.0
    if interface == "force":
        stiffness = 2.0 * controller.gamma_defect / (controller.gamma_force * mass**2)
        passed = 1.0 / (1.0 + stiffness)
        share = 1.0 - passed
    gains = (controller.ki_z, controller.kp_z, controller.kd_z)
    A = np.zeros((4, 4))  # ∫z, z, z', 1
    A[0, 1] = A[1, 2] = 1.0
    A[2, 3] = passed * _GAIN_FORCE / mass
    A[2, :3] = -share * np.array(gains)
    step = linalg.expm(A * SAMPLE_MS / 1000.0)
    state = np.array([0.0, 0.0, 0.0, 1.0])
    z = np.empty(N)
    for k in range(N):
        state = step @ state
        z[k] = state[1]
    return z
