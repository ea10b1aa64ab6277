"""The gates: what each figure means, and that a wrong predictor does not pass."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import integrate, linalg, optimize

from quadriga.agents.planner.acceptance import (
    are_same_costs,
    best_response_map,
    best_response_radius,
    probe_costs,
    run_gates,
)
from quadriga.agents.predictor.episode import Y_SCALE
from quadriga.agents.predictor.fits import fit_ridge
from quadriga.agents.predictor.gates import (
    GateReport,
    height_gains,
    held_out_error,
    physical_height,
)
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.agents.time_grid import horizon_stance
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError
from quadriga.shared.robots.conventions import Array
from tests.a1 import TOTAL_MASS, build_problem
from tests.plugins.kinds import install_kind

Team = Callable[..., Any]


@pytest.fixture(scope="module")
def plant(small: Config) -> Config:
    """The configuration whose low level is what the linear team has: no height integrator."""
    return replace(small, controller=replace(small.controller, ki_z=0.0))


@pytest.fixture(scope="module")
def predictor(plant: Config, linear_team: Team) -> Predictor:
    meta = replace(PredictorMeta.of(plant), ridge=1e-9, block_weight=1.0)
    return fit_ridge([linear_team(2).episode(1500, 1)], meta)


def coupled(config: Config, seed: int, strength: float) -> Predictor:
    """Any G of a plausible size whose blocks off the diagonal are `strength` times as large."""
    meta = PredictorMeta.of(config)
    shape = (meta.robots, meta.robots, meta.N, 6, meta.width)
    G = np.random.default_rng(seed).normal(size=shape)
    G *= 1e-4 * np.array([1.0, 30.0, 30.0, 10.0, 10.0, 30.0])[:, None]
    G *= np.where(np.eye(meta.robots), 1.0, strength)[:, :, None, None, None]
    return Predictor(meta, G.reshape(1, meta.robots, meta.robots, -1, meta.width))


def test_a_right_predictor_passes(plant: Config, predictor: Predictor, linear_team: Team) -> None:
    report = run_gates(plant, predictor, [linear_team(2).episode(200, 50)])
    report.check()
    assert report.error < 1e-5
    assert report.windows == 189
    np.testing.assert_allclose(report.gains, 1.0, atol=1e-4)
    assert GateReport.from_dict(report.to_dict()) == report


def test_held_out_error_against_windows_predicted_one_by_one(
    plant: Config, linear_team: Team
) -> None:
    predictor = coupled(plant, seed=0, strength=0.5)
    T_ini, N = predictor.meta.T_ini, predictor.meta.N
    data = linear_team(2).episode(30, 51)
    du, dy = data.deviations()
    errors, naive = [], []
    for k in range(30 - T_ini - N + 1):
        past, future = slice(k, k + T_ini), slice(k + T_ini, k + T_ini + N)
        z = [
            np.concatenate([du[past, j].ravel(), dy[past, j].ravel(), du[future, j].ravel()])
            for j in range(2)
        ]
        for i in range(2):
            y = sum(predictor.block(i, j) @ z[j] for j in range(2))
            errors.append(y.reshape(N, 6) - dy[future, i])
            naive.append(data.y[future, i] - data.y[k + T_ini - 1, i])
    windows, rmse, persistence, ratio = held_out_error(predictor, [data])
    assert windows == 19
    np.testing.assert_allclose(rmse, np.sqrt(np.mean(np.array(errors) ** 2, axis=(0, 1))))
    np.testing.assert_allclose(persistence, np.sqrt(np.mean(np.array(naive) ** 2, axis=(0, 1))))
    scale = np.array([0.005, 0.1, 0.1, 0.02, 0.02, 0.2])
    expected = np.sqrt(np.mean((errors / scale) ** 2) / np.mean((naive / scale) ** 2))
    assert ratio == pytest.approx(expected)


def test_a_predictor_worse_than_persistence_is_refused(plant: Config, linear_team: Team) -> None:
    wild = coupled(plant, seed=1, strength=1.0)
    report = run_gates(plant, wild, [linear_team(2).episode(100, 52)])
    assert report.error > 1.0
    with pytest.raises(PredictorError, match=r"held-out error: got \d+\.\d{3} of persistence"):
        report.check()


def test_no_held_out_data_is_an_error(
    plant: Config, predictor: Predictor, linear_team: Team
) -> None:
    for episodes in ([], [linear_team(2).episode(11, 53)]):
        with pytest.raises(PredictorError, match="expected at least 12 samples"):
            run_gates(plant, predictor, episodes)


@pytest.mark.parametrize("ki", [0.0, 400.0])
def test_the_physical_response_is_the_integrated_equation(plant: Config, ki: float) -> None:
    controller = replace(plant.controller, kp_z=400.0, kd_z=40.0, ki_z=ki)

    def rate(_: float, s: Array) -> list[float]:
        return [s[1], s[2], 10.0 / TOTAL_MASS - ki * s[0] - 400.0 * s[1] - 40.0 * s[2]]

    times = 0.01 * np.arange(1, 26)
    found = integrate.solve_ivp(rate, (0, 0.25), [0.0] * 3, t_eval=times, rtol=1e-10, atol=1e-14)
    np.testing.assert_allclose(
        physical_height(replace(plant, controller=controller), "feedforward", 25),
        found.y[1],
        rtol=1e-6,
    )


def test_a_free_trunk_rises_with_half_a_t_squared(plant: Config) -> None:
    times = 0.01 * np.arange(1, 26)
    expected = 0.5 * 10.0 / TOTAL_MASS * times**2
    soft = replace(plant.controller, gamma_defect=1e-9)
    np.testing.assert_allclose(
        physical_height(replace(plant, controller=soft), "force", 25), expected, rtol=1e-9
    )


def test_the_qp_lets_the_share_of_a_force_through_that_minimises_its_cost(plant: Config) -> None:
    controller = replace(plant.controller, kp_z=0.0, kd_z=0.0, ki_z=0.0, gamma_defect=1e5)
    half = 0.5 * 10.0  # of the force asked for, on each of two feet

    def cost(f: float) -> float:
        return float(
            2 * controller.gamma_force / 2 * (f - half) ** 2
            + controller.gamma_defect / 2 * (2 * f / TOTAL_MASS) ** 2
        )

    realised = optimize.minimize_scalar(
        cost, bounds=(0.0, half), method="bounded", options={"xatol": 1e-10}
    ).x
    z = physical_height(replace(plant, controller=controller), "force", 25)
    assert z[-1] == pytest.approx(0.5 * 2 * realised / TOTAL_MASS * 0.25**2, rel=1e-6)


def test_a_wrong_sign_of_the_gain_is_refused(plant: Config, predictor: Predictor) -> None:
    """What data from a stiff feedback loop give: low error, forces that pull the wrong way."""
    G = predictor.G.copy()
    G[0, 1, 1, ::6, predictor.meta.past :] *= -1.6
    wrong = Predictor(predictor.meta, G)
    np.testing.assert_allclose(height_gains(plant, wrong)[1], -1.6, atol=1e-3)
    report = GateReport(
        1, {}, {}, 0.5, (0.1, 0.25), ((1.0, 1.0), (-1.6, -1.6)), (0.3, 2.0), 0.1, 0.5, (), ()
    )
    with pytest.raises(PredictorError, match=r"r2 at 0\.1 s: got -1\.60, expected 0\.3 … 2"):
        report.check()


def test_a_figure_that_is_not_a_number_is_refused() -> None:
    report = GateReport(1, {}, {}, 0.5, (0.1,), ((1.0,),), (0.3, 2.0), 0.1, 0.5, (), ())
    report.check()
    nan = float("nan")
    for broken in (
        replace(report, error=nan),
        replace(report, radius=nan),
        replace(report, gains=((nan,),)),
    ):
        with pytest.raises(PredictorError, match="got nan"):
            broken.check()


def test_a_single_robot_has_no_best_responses(plant: Config) -> None:
    alone = replace(plant, team=replace(plant.team, robots=1))
    assert best_response_radius(alone, coupled(alone, 0, 1.0)) == 0.0


def test_the_best_response_is_the_planners_own(plant: Config) -> None:
    """U_0 that minimises agent 0's cost of eq. 12, by hand, for plans of agent 1."""
    predictor, step = coupled(plant, seed=2, strength=1.0), 20
    problems = [
        build_problem(plant.planner, predictor.future_block(i, i), horizon_stance(plant, i, step))
        for i in range(2)
    ]
    first = len(problems[0].columns)
    U = np.random.default_rng(2).normal(size=first + len(problems[1].columns))
    du = np.zeros(12 * plant.planner.N)
    du[problems[1].columns] = U[first:]
    Q = np.diag(np.tile(plant.planner.Q, plant.planner.N))
    R = np.diag(np.tile(plant.planner.R, first // 3))
    G = predictor.future_block(0, 0)[:, problems[0].columns]
    best = -np.linalg.solve(G.T @ Q @ G + R, G.T @ Q @ predictor.future_block(0, 1) @ du)
    answer = best_response_map(plant, predictor, step) @ U
    np.testing.assert_allclose(answer[:first], best, atol=1e-9)


def test_damping_mixes_the_best_response_with_the_last_plan(plant: Config) -> None:
    """Eigenvalues λ become (1 − d) λ + d, and the figures of other plans are not taken for them."""
    predictor = coupled(plant, seed=2, strength=1.0)
    damped = replace(plant, planner=replace(plant.planner, damping=0.25))
    values = linalg.eigvals(best_response_map(plant, predictor, 20))
    expected = np.abs(0.75 * values + 0.25).max()
    found = np.abs(linalg.eigvals(best_response_map(damped, predictor, 20))).max()
    assert found == pytest.approx(expected)
    assert not are_same_costs(probe_costs(plant, predictor), probe_costs(damped, predictor))


@settings(max_examples=12, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), strength=st.floats(0.05, 3.0))
def test_the_radius_tells_whether_the_iteration_of_plans_converges(
    seed: int, strength: float
) -> None:
    """Growth per iteration of the largest plan, measured over many iterations."""
    planner = replace(Config().planner, N=4, T_ini=2, applied=4)
    config = replace(Config(), team=replace(Config().team, robots=3), planner=planner)
    predictor = coupled(config, seed, strength)
    radius = best_response_radius(config, predictor)
    growth = 0.0
    for step in range(8, 18):
        B = best_response_map(config, predictor, step)
        U = np.random.default_rng(seed).normal(size=len(B))
        log_size = 0.0
        for _ in range(500):
            U = B @ U
            size = float(np.linalg.norm(U))
            log_size, U = log_size + np.log(size), U / size
        growth = max(growth, float(np.exp(log_size / 500)))
    assert growth == pytest.approx(radius, rel=0.03)


def test_block_weight_reduces_the_radius(plant: Config, linear_team: Team) -> None:
    """Noisy data of a strongly coupled team: without the weight the plans would diverge."""
    data = [linear_team(2, coupling=4.0).episode(250, 5, noise=3.0)]
    radius = {}
    for weight in (1.0, 100.0):
        meta = replace(PredictorMeta.of(plant), ridge=1e-3, block_weight=weight)
        radius[weight] = best_response_radius(plant, fit_ridge(data, meta))
    assert radius[1.0] > 1.0
    assert radius[100.0] < 0.5
    report = GateReport(
        1, {}, {}, 0.5, (0.1,), ((1.0,),), (0.3, 2.0), radius[1.0], radius[100.0], (), ()
    )
    with pytest.raises(PredictorError, match=r"raise identification\.block_weight"):
        report.check()
    for kind in ("centralised", "decentralised"):
        report.check(kind)  # nobody answers anybody's plans


@pytest.mark.parametrize("responds", [True, False])
def test_a_plugin_that_responds_to_plans_is_held_against_the_radius(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, responds: bool
) -> None:
    kind = "answering" if responds else "deaf"
    install_kind(tmp_path, monkeypatch, kind, f"'nowhere:P', needs_peers={responds}")
    report = GateReport(1, {}, {}, 0.5, (0.1,), ((1.0,),), (0.3, 2.0), 0.9, 0.5, (), ())
    if not responds:
        report.check(kind)
        return
    with pytest.raises(PredictorError, match=r"radius of the best-response map: got 0\.900"):
        report.check(kind)


def phased(predictor: Predictor, *others: Array) -> Predictor:
    """The predictor with its own G in phase 0 and others in the following ones."""
    meta = replace(predictor.meta, phases=1 + len(others))
    return Predictor(meta, np.concatenate([predictor.G, *others]))


def test_each_window_is_predicted_by_the_g_of_its_phase(
    plant: Config, predictor: Predictor, linear_team: Team
) -> None:
    """Right in the first half of the gait, silent in the second: there all of y is the error."""
    data, (T_ini, N) = linear_team(2).episode(200, 50), (predictor.meta.T_ini, predictor.meta.N)
    _, rmse, _, _ = held_out_error(phased(predictor, np.zeros_like(predictor.G)), [data])
    _, y = data.windows(T_ini, N)
    ends = 410 + 10 * (T_ini - 1 + np.arange(y.shape[2]))
    silent = (ends - 300) % 400 >= 200
    squares = (y[:, :, silent].reshape(2, N, 6, -1) ** 2).sum(axis=(0, 1, 3))
    np.testing.assert_allclose(rmse, np.sqrt(squares / (2 * N * len(silent))), rtol=1e-4)


def test_the_worst_phase_counts(plant: Config, predictor: Predictor) -> None:
    same = phased(predictor, predictor.G)
    np.testing.assert_allclose(height_gains(plant, same), 1.0, atol=1e-3)
    wrong = predictor.G.copy()
    wrong[0, 1, 1] *= -0.5
    np.testing.assert_allclose(height_gains(plant, phased(predictor, wrong))[0], 1.0, atol=1e-3)
    np.testing.assert_allclose(height_gains(plant, phased(predictor, wrong))[1], -0.5, atol=1e-3)

    tight, loose = coupled(plant, seed=3, strength=1.0), coupled(plant, seed=4, strength=0.1)
    both = phased(loose, tight.G)
    steps = range(8, 18)  # the gait's period begins at 300 ms, step 8 is at 320 ms
    late = [(40 * step - 300) % 400 >= 200 for step in steps]
    expected = max(
        np.abs(np.linalg.eigvals(best_response_map(plant, tight if second else loose, step))).max()
        for step, second in zip(steps, late, strict=True)
    )
    assert best_response_radius(plant, both) == pytest.approx(expected)
    assert best_response_radius(plant, loose) < 0.5 * expected


def test_the_report_shows_coupling_condition_and_size(
    plant: Config, predictor: Predictor, linear_team: Team
) -> None:
    report = run_gates(plant, predictor, [linear_team(2).episode(100, 54)])
    assert report.size == 8 * 2 * 2 * 48 * 168
    assert report.condition == predictor.condition
    assert report.condition is not None
    assert report.condition > 1.0
    z_scale = np.r_[np.full(48, 10.0), np.tile(Y_SCALE, 4), np.full(96, 10.0)]
    for i in range(2):
        for j in range(2):
            scaled = predictor.block(i, j) * z_scale / np.tile(Y_SCALE, 8)[:, None]
            assert report.coupling[i][j] == pytest.approx(np.linalg.norm(scaled))
    assert report.coupling[0][0] > report.coupling[0][1] > 0.0
    double = phased(predictor, 2.0 * predictor.G)
    np.testing.assert_allclose(
        run_gates(plant, double, [linear_team(2).episode(100, 54)]).coupling,
        2.0 * np.array(report.coupling),
    )
