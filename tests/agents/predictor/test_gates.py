"""The gates: what each figure means, and that no wrong or foreign predictor passes."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import integrate, linalg, optimize

from quadriga.agents.gait import horizon_stance
from quadriga.agents.planner import qp
from quadriga.agents.planner.qp import Condensed
from quadriga.agents.predictor.episode import Y_SCALE, Episode
from quadriga.agents.predictor.gates import (
    Bounds,
    GateReport,
    Provenance,
    best_response_map,
    coupling_table,
    height_gains,
    held_out_error,
    iteration_radius,
    load_checked,
    peers_harm,
    physical_height,
    run_gates,
)
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta, fit_plant
from quadriga.shared.config.sections import Config, PlannerConfig
from quadriga.shared.errors import PredictorError
from quadriga.shared.robots.conventions import OUTPUTS, Array
from tests.a1 import TOTAL_MASS, build_problem
from tests.agents.conftest import fit_ridge
from tests.agents.predictor.plants import Sizes, first_window, random_plant, record

Team = Callable[..., Any]
FINE = GateReport(0.5, ((1.0, 1.0), (1.0, 1.0)), 0.1)
# The springs of the linear team act on these; its height, pitch and yaw rate know no peers.
COUPLED = ("vx", "vy")


@pytest.fixture(scope="module")
def predictor(plant: Config, linear_team: Team) -> Predictor:
    """The truth of the linear team, but for rounding."""
    meta = replace(PredictorMeta.of(plant), ridge=1e-9, block_weight=1.0)
    return fit_ridge([linear_team(2).episode(1500, 1)], meta)


def coupled(config: Config, seed: int, strength: float) -> Predictor:
    """Any G of a plausible size whose blocks off the diagonal are `strength` times as large."""
    meta = PredictorMeta.of(config)
    shape = (meta.robots, meta.robots, meta.N, 6, meta.layout.width)
    G = np.random.default_rng(seed).normal(size=shape)
    G *= 1e-4 * np.array([1.0, 30.0, 30.0, 10.0, 10.0, 30.0])[:, None]
    G *= np.where(np.eye(meta.robots), 1.0, strength)[:, :, None, None, None]
    return Predictor(meta, G.reshape(1, meta.robots, meta.robots, -1, meta.layout.width))


def of_kind(config: Config, kind: str) -> Config:
    return replace(config, planner=replace(config.planner, kind=kind))


def limited(config: Config, **limits: Any) -> Config:
    return replace(config, identification=replace(config.identification, **limits))


# ---- what a report says and refuses


def test_a_right_predictor_passes(plant: Config, predictor: Predictor, linear_team: Team) -> None:
    report = run_gates(plant, predictor, [linear_team(2).episode(200, 50)])
    report.check(plant)
    assert report.error < 1e-5
    np.testing.assert_allclose(report.gains, 1.0, atol=1e-4)
    whole = asdict(Provenance("abc", (1, 2), (9,), (3,), {"a": "1"}, report, 2.0))
    for body in (whole, json.loads(json.dumps(whole))):
        assert asdict(Provenance.from_dict(body)) == whole


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"error": 1.5}, r"held-out error: got 1\.500 of persistence, expected below 1"),
        ({"error": np.nan}, "held-out error: got nan"),
        ({"gains": ((1.0, 1.0), (-1.6, 1.0))}, r"r2 at 0\.1 s: got -1\.60, expected 0\.3 … 2"),
        ({"gains": ((np.nan, 1.0),)}, "got nan"),
        ({"radius": np.nan}, "radius of the best-response map: got nan"),
        ({"radius": 1.2}, r"best-response map.*raise identification\.block_weight"),
        ({"harm": {"z": Bounds(0.3, 0.1, 0.5)}}, "peers on z: got 30 % more"),
    ],
)
def test_a_figure_beyond_its_limit_is_refused(
    plant: Config, changes: dict[str, Any], text: str
) -> None:
    FINE.check(plant)
    report = replace(FINE, **changes)
    with pytest.raises(PredictorError, match=text):
        report.check(plant)
    if "radius" in changes or "harm" in changes:  # nobody answers anybody's plans
        for kind in ("centralised", "decentralised"):
            report.check(of_kind(plant, kind))
    if changes in ({"radius": 1.2}, {"harm": report.harm}):
        report.check(limited(plant, max_radius=2.0, max_peers_harm=1e9))


def test_cooperative_plans_have_a_limit_of_their_own(plant: Config) -> None:
    cooperative = replace(plant, planner=replace(plant.planner, cost="team"))
    with pytest.raises(PredictorError, match=r"cooperative map: got 1\.200, expected below 1 "):
        replace(FINE, radius=1.2).check(limited(cooperative, max_radius=2.0))


# ---- files


def test_what_is_saved_is_loaded(
    stored: Path, plant: Config, fitted: tuple[Predictor, Provenance]
) -> None:
    predictor, provenance = load_checked(stored, plant)
    assert predictor.G.tobytes() == fitted[0].G.tobytes()
    assert (predictor.meta, provenance) == (fitted[0].meta, fitted[1])
    other = replace(
        plant,
        controller=replace(plant.controller, damping=3.0),
        world=replace(plant.world, seed=7, terrain="boxes"),
    )
    load_checked(stored, other)  # what does not touch the plant may differ
    with pytest.raises(PredictorError, match=r"got no such file.*`quadriga fit`"):
        load_checked(stored.with_name("none.npz"), plant)
    with pytest.raises(PredictorError, match="height gain of r1"):
        load_checked(stored, limited(plant, gain_range=(1.5, 2.0)))


@pytest.mark.parametrize(
    ("section", "changes", "message"),
    [
        ("team", {"robots": 3}, "robots: got 2, expected 3 as configured"),
        ("team", {"yokes": "chain"}, "yokes: got 'complete', expected 'chain'"),
        ("team", {"alternate_phase": False}, "alternate_phase: got True, expected False"),
        ("gait", {"stance_ms": 150}, "stance_ms: got 200, expected 150"),
        ("planner", {"N": 20}, "N: got 8, expected 20"),
        ("planner", {"T_ini": 12}, "T_ini: got 4, expected 12"),
        ("planner", {"interface": "force"}, "interface: got 'feedforward', expected 'force'"),
        ("controller", {"kp_z": 100.0}, r"controller\.kp_z: got 400\.0, expected 100\.0"),
    ],
)
def test_a_foreign_predictor_is_refused_by_name(
    stored: Path, plant: Config, section: str, changes: dict[str, Any], message: str
) -> None:
    foreign = replace(plant, **{section: replace(getattr(plant, section), **changes)})
    with pytest.raises(PredictorError, match=f"{message}.*`quadriga fit`"):
        load_checked(stored, foreign)


def test_any_other_key_of_the_planner_is_gated_anew(
    stored: Path, plant: Config, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As if `force_min` weighed the differences between successive forces: no list names it."""
    condense = qp.condense

    def smoothing(
        config: PlannerConfig, G_past: Array, G_u: Array, stance: NDArray[np.bool_]
    ) -> Condensed:
        usual = condense(config, G_past, G_u, stance)
        steps = np.diff(np.eye(len(usual.H)), axis=0)
        return replace(usual, H=usual.H + config.force_min * steps.T @ steps)

    before = load_checked(stored, plant)[1].gates
    monkeypatch.setattr(qp, "condense", smoothing)
    assert load_checked(stored, plant)[1].gates == before, "of the same planner it is not computed"
    smooth = replace(plant, planner=replace(plant.planner, force_min=5.0))
    assert load_checked(stored, smooth)[1].gates.radius < 0.9 * before.radius
    alone = of_kind(smooth, "decentralised")
    assert load_checked(stored, alone)[1].gates == before, "nobody answers anybody's plans"
    cheap = replace(plant, planner=replace(plant.planner, R=(1e-7, 1e-7, 1e-7)))
    after = load_checked(stored, limited(cheap, max_radius=10.0))[1].gates.radius
    assert after > 2 * before.radius, "with forces made cheap the plans fight harder"
    between = 0.5 * (before.radius + after)
    load_checked(stored, limited(plant, max_radius=between))
    with pytest.raises(PredictorError, match="radius of the best-response map"):
        load_checked(stored, limited(cheap, max_radius=between))


# ---- held-out error


def test_held_out_error_against_windows_predicted_one_by_one() -> None:
    """Of any plant: two agents with one input and two outputs each."""
    sizes, noise = Sizes(2, 1, 2, 4), 0.05
    plant = random_plant(sizes, 11)
    predictor = fit_plant(record(plant, sizes, (900,), 12, noise), "ridge", 4, 5)
    data = record(plant, sizes, (60, 3, 50), 13, noise)
    errors, naive = [], []
    for episode in (data[0], data[2]):
        for k in range(episode.samples - 8):
            cut = Episode.of(episode.u[k:], episode.y[k:])
            past_u, past_y, future_u, true = first_window(cut, 4, 5)
            errors.append(predictor.forecast(past_u, past_y, future_u) - true)
            naive.append(past_y[-1] - true)
    rmse, persistence, ratio = held_out_error(predictor, data)
    assert len(errors) == (60 - 8) + (50 - 8)
    ours, theirs = (np.sqrt(np.mean(np.square(all_), axis=(0, 2))) for all_ in (errors, naive))
    np.testing.assert_allclose((rmse, persistence), (ours, theirs))
    scale = np.array(predictor.layout.y_scale)
    assert ratio == pytest.approx(np.linalg.norm(ours / scale) / np.linalg.norm(theirs / scale))
    assert ratio < 0.3
    assert (np.sqrt((rmse**2).mean(axis=0)) > 0.9 * noise).all()
    with pytest.raises(PredictorError, match="expected at least 9 samples"):
        held_out_error(predictor, [data[1]])


def phased(predictor: Predictor, *others: Array) -> Predictor:
    """The predictor with its own G in phase 0 and others in the following ones."""
    meta = replace(predictor.meta, phases=1 + len(others))
    return Predictor(meta, np.concatenate([predictor.G, *others]))


def test_each_window_is_predicted_by_the_g_of_its_phase(
    predictor: Predictor, linear_team: Team
) -> None:
    """Right in the first half of the gait, silent in the second: there all of y is the error."""
    data, (T_ini, N) = linear_team(2).episode(200, 50), (predictor.meta.T_ini, predictor.meta.N)
    rmse, _, _ = held_out_error(phased(predictor, np.zeros_like(predictor.G)), [data])
    _, y = data.windows(T_ini, N)
    ends = 410 + 10 * (T_ini - 1 + np.arange(y.shape[2]))
    silent = (ends - 300) % 400 >= 200
    squares = (y[:, :, silent].reshape(2, N, 6, -1) ** 2).sum(axis=(0, 3))
    np.testing.assert_allclose(rmse, np.sqrt(squares / (2 * len(silent))), rtol=1e-4)


# ---- height gain and coupling


@pytest.mark.parametrize("ki", [0.0, 400.0])
def test_the_physical_response_is_the_integrated_equation(plant: Config, ki: float) -> None:
    controller = replace(plant.controller, kp_z=400.0, kd_z=40.0, ki_z=ki)

    def rate(_: float, s: Array) -> list[float]:
        return [s[1], s[2], 10.0 / TOTAL_MASS - ki * s[0] - 400.0 * s[1] - 40.0 * s[2]]

    times = 0.01 * np.arange(1, 26)
    found = integrate.solve_ivp(rate, (0, 0.25), [0.0] * 3, t_eval=times, rtol=1e-10, atol=1e-14)
    response = physical_height(replace(plant, controller=controller), 25)
    np.testing.assert_allclose(response, found.y[1], rtol=1e-6)


def test_the_qp_lets_the_share_of_a_force_through_that_minimises_its_cost(plant: Config) -> None:
    loose = replace(plant.controller, kp_z=0.0, kd_z=0.0, ki_z=0.0, gamma_defect=1e5)
    planner = replace(plant.planner, interface="force")
    config = replace(plant, planner=planner, controller=loose)
    half = 0.5 * 10.0  # of the force asked for, on each of two feet

    def cost(f: float) -> float:
        effort = 2 * config.controller.gamma_force / 2 * (f - half) ** 2
        return float(effort + config.controller.gamma_defect / 2 * (2 * f / TOTAL_MASS) ** 2)

    realised = optimize.minimize_scalar(
        cost, bounds=(0.0, half), method="bounded", options={"xatol": 1e-10}
    ).x
    z = physical_height(config, 25)
    assert z[-1] == pytest.approx(0.5 * 2 * realised / TOTAL_MASS * 0.25**2, rel=1e-6)


def test_the_worst_phase_counts(plant: Config, predictor: Predictor) -> None:
    """A wrong sign of the gain is what data from a stiff feedback loop give."""
    same = phased(predictor, predictor.G)
    np.testing.assert_allclose(height_gains(plant, same), 1.0, atol=1e-3)
    wrong = predictor.G.copy()
    wrong[0, 1, 1] *= -0.5
    np.testing.assert_allclose(height_gains(plant, phased(predictor, wrong))[0], 1.0, atol=1e-3)
    np.testing.assert_allclose(height_gains(plant, phased(predictor, wrong))[1], -0.5, atol=1e-3)

    tight, loose = coupled(plant, seed=3, strength=1.0), coupled(plant, seed=4, strength=0.1)
    steps = range(8, 18)  # the gait's period begins at 300 ms, step 8 is at 320 ms
    late = [(40 * step - 300) % 400 >= 200 for step in steps]
    expected = max(
        np.abs(np.linalg.eigvals(best_response_map(plant, tight if second else loose, step))).max()
        for step, second in zip(steps, late, strict=True)
    )
    assert iteration_radius(plant, phased(loose, tight.G)) == pytest.approx(expected)
    assert iteration_radius(plant, loose) < 0.5 * expected


def test_the_table_of_coupling_has_the_norms_of_scaled_blocks(predictor: Predictor) -> None:
    z_scale = np.r_[np.full(48, 10.0), np.tile(Y_SCALE, 4), np.full(96, 10.0)]
    scaled = predictor.G[0] * z_scale / np.tile(Y_SCALE, 8)[:, None]
    found = coupling_table(predictor)
    np.testing.assert_allclose(found, np.linalg.norm(scaled, axis=(2, 3)))
    assert found[0, 0] > found[0, 1] > 0.0
    np.testing.assert_allclose(coupling_table(phased(predictor, 2.0 * predictor.G)), 2.0 * found)


# ---- whether the plans converge


def test_the_best_response_is_the_planners_own(plant: Config, linear_team: Team) -> None:
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
    alone = replace(plant, team=replace(plant.team, robots=1))
    assert iteration_radius(alone, coupled(alone, 0, 1.0)) == 0.0
    assert peers_harm(coupled(alone, 0, 1.0), [linear_team(1).episode(300, 2)]) == {}


def test_damping_mixes_the_best_response_with_the_last_plan(plant: Config) -> None:
    """Eigenvalues λ become (1 − d) λ + d."""
    predictor = coupled(plant, seed=2, strength=1.0)
    damped = replace(plant, planner=replace(plant.planner, damping=0.25))
    values = linalg.eigvals(best_response_map(plant, predictor, 20))
    expected = np.abs(0.75 * values + 0.25).max()
    found = np.abs(linalg.eigvals(best_response_map(damped, predictor, 20))).max()
    assert found == pytest.approx(expected)


@settings(max_examples=12, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), strength=st.floats(0.05, 3.0))
def test_the_radius_tells_whether_the_iteration_of_plans_converges(
    seed: int, strength: float
) -> None:
    """Growth per iteration of the largest plan, measured over many iterations."""
    planner = replace(Config().planner, N=4, T_ini=2, applied=4)
    config = replace(Config(), team=replace(Config().team, robots=3), planner=planner)
    predictor = coupled(config, seed, strength)
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
    assert growth == pytest.approx(iteration_radius(config, predictor), rel=0.03)


# ---- effect of peers


def with_peers(predictor: Predictor, factor: float, invented: float = 0.0) -> Predictor:
    """The same with other effects of the peers' forces: scaled, and with noise of a share."""
    G, past = predictor.G.copy(), predictor.layout.past
    random = np.random.default_rng(5)
    for i, j in ((0, 1), (1, 0)):
        G[:, i, j, :, past:] *= factor
        own = G[:, i, i, :, past:]
        noise = random.normal(size=own.shape) * np.abs(own).mean(axis=2, keepdims=True)
        G[:, i, j, :, past:] += invented * noise
    return replace(predictor, parts=G)


@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0, -1.0])
def test_the_harm_is_that_of_a_part_too_large_or_small(
    factor: float, predictor: Predictor, linear_team: Team
) -> None:
    """Without noise r is the true effect q, and p = a q: harm ((1 − a)² − 1)."""
    found = peers_harm(with_peers(predictor, factor), [linear_team(2).episode(600, 50)])
    for name in COUPLED:
        np.testing.assert_allclose(found[name], (1.0 - factor) ** 2 - 1.0, atol=1e-3)


@pytest.mark.parametrize("coupling", [0.0, 1.0])
def test_who_invents_effects_of_peers_is_refused(
    coupling: float, plant: Config, linear_team: Team
) -> None:
    team = linear_team(2, coupling)
    meta = replace(PredictorMeta.of(plant), ridge=1e-9, block_weight=1.0)
    right, data = fit_ridge([team.episode(1500, 1)], meta), team.episode(600, 50, noise=0.01)
    replace(FINE, harm=peers_harm(right, [data])).check(plant)
    found = peers_harm(with_peers(right, 1.0, invented=1.0), [data])
    with pytest.raises(PredictorError, match=r"effect of peers on z: got \d+ % more squared error"):
        replace(FINE, harm=found).check(plant)


def test_harm_against_windows_one_by_one(predictor: Predictor, linear_team: Team) -> None:
    changed = with_peers(predictor, 0.7, invented=0.2)
    data, alone = linear_team(2).episode(300, 51, noise=0.01), with_peers(changed, 0.0)
    T_ini, N = changed.layout.T_ini, changed.layout.N
    z, dy = data.windows(T_ini, N)
    whole, without = (
        ((one.predict(z) - dy) ** 2).reshape(2, N, 6, -1).sum(axis=(0, 1, 3))
        for one in (changed, alone)
    )
    found = peers_harm(changed, [data])
    np.testing.assert_allclose([found[name].value for name in OUTPUTS], whole / without - 1.0)
    assert peers_harm(changed, [linear_team(2).episode(60, 51)]) == {}, "one block: no interval"


def test_intervals_cover_the_truth_as_often_as_they_say(
    predictor: Predictor, linear_team: Team
) -> None:
    """Nineteen of twenty; fewer than sixteen of twenty would be a chance of one in 400."""
    changed, team = with_peers(predictor, 2.0), linear_team(2)
    # The truth, from much more data: p is twice the effect, so that noise alone makes the harm.
    truth = peers_harm(changed, [team.episode(20_000, 99, noise=0.3)])["vy"].value
    inside = 0
    for seed in range(20):
        _, low, high = peers_harm(changed, [team.episode(500, 100 + seed, noise=0.3)])["vy"]
        inside += low <= truth <= high
    assert inside >= 16
