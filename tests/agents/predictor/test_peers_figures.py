"""What a predictor says of peers is held against what they do: a team whose coupling is known."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.agents.planner.acceptance import run_gates
from quadriga.agents.predictor.fits import fit_ridge
from quadriga.agents.predictor.gates import Bounds, GateReport, PeersFigures, peers_figures
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError
from quadriga.shared.robots.conventions import OUTPUTS

Team = Callable[..., Any]
LIMIT = 0.02
# The springs of the linear team act on these. They act on its roll too, but hardly within the
# horizon; its height, pitch and yaw rate know no peers.
COUPLED, ALONE = ("vx", "vy"), ("z", "roll", "pitch", "wz")


@pytest.fixture(scope="module")
def predictor(small: Config, linear_team: Team) -> Predictor:
    """The truth of the linear team, but for rounding."""
    meta = replace(PredictorMeta.of(small), ridge=1e-9, block_weight=1.0)
    return fit_ridge([linear_team(2).episode(1500, 1)], meta)


def with_peers(predictor: Predictor, factor: float, invented: float = 0.0) -> Predictor:
    """The same with other effects of the peers' forces: scaled, and with noise of a share."""
    G, past = predictor.G.copy(), predictor.meta.past
    random = np.random.default_rng(5)
    for i, j in ((0, 1), (1, 0)):
        G[:, i, j, :, past:] *= factor
        own = G[:, i, i, :, past:]
        noise = random.normal(size=own.shape) * np.abs(own).mean(axis=2, keepdims=True)
        G[:, i, j, :, past:] += invented * noise
    return replace(predictor, parts=G)


def figures_of(predictor: Predictor, team: Any, samples: int = 600) -> PeersFigures:
    found = peers_figures(predictor, [team.episode(samples, 50, noise=0.01)], LIMIT)
    assert found is not None
    return found


@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0, -1.0])
def test_the_slope_is_what_is_measured_over_what_is_predicted(
    factor: float, predictor: Predictor, linear_team: Team
) -> None:
    """Without noise r is the true effect q, and p = a q: slope 1/a, harm ((1 − a)² − 1)."""
    changed = with_peers(predictor, factor)
    found = peers_figures(changed, [linear_team(2).episode(600, 50)], LIMIT)
    assert found is not None
    for name in COUPLED:
        for bound in found.slope[name]:
            assert bound == pytest.approx(1.0 / factor, abs=1e-3)
        for bound in found.harm[name]:
            assert bound == pytest.approx((1.0 - factor) ** 2 - 1.0, abs=1e-3)
        share = figures_of(predictor, linear_team(2)).share[name]
        assert share is not None
        assert found.share[name] == pytest.approx(abs(factor) * share, rel=0.05)


def test_the_truth_is_confirmed_where_there_is_coupling(
    predictor: Predictor, linear_team: Team
) -> None:
    found = figures_of(predictor, linear_team(2))
    found.check()
    assert found.outputs_with("confirmed") == COUPLED
    assert found.outputs_with("left out") == ALONE
    assert found.describe() == f"left out: {', '.join(ALONE)}"


def test_who_ignores_peers_is_told(predictor: Predictor, linear_team: Team) -> None:
    shrunk, without = (
        figures_of(with_peers(predictor, factor), linear_team(2)) for factor in (0.3, 0.0)
    )
    for found in (shrunk, without):
        found.check()  # its agents may well do without
    assert set(shrunk.outputs_with("understated")) == set(COUPLED)
    assert set(without.outputs_with("left out")) == set(OUTPUTS)
    assert without.slope["vx"] == Bounds(None, None, None)


@pytest.mark.parametrize("coupling", [0.0, 1.0])
def test_who_invents_effects_of_peers_is_refused(
    coupling: float, small: Config, predictor: Predictor, linear_team: Team
) -> None:
    team = linear_team(2, coupling)
    meta = replace(PredictorMeta.of(small), ridge=1e-9, block_weight=1.0)
    right = fit_ridge([team.episode(1500, 1)], meta)
    figures_of(right, team).check()
    found = figures_of(with_peers(right, 1.0, invented=1.0), team)
    assert "z" in found.outputs_with("invented")
    with pytest.raises(PredictorError, match=r"effect of peers on z: got \d+ % more squared error"):
        found.check()
    replace(found, harm_limit=1e9).check()


def test_a_report_refuses_only_for_planners_that_respond_to_peers(
    small: Config, predictor: Predictor, linear_team: Team
) -> None:
    plant = replace(small, controller=replace(small.controller, ki_z=0.0))
    episode = linear_team(2).episode(600, 50, noise=0.01)
    report = run_gates(plant, with_peers(predictor, 1.0, invented=0.3), [episode])
    report = replace(report, radius=0.0)
    with pytest.raises(PredictorError, match="effect of peers on z"):
        report.check("distributed")
    for kind in ("decentralised", "centralised"):
        report.check(kind)
    assert GateReport.from_dict(json.loads(json.dumps(report.to_dict()))) == report
    assert GateReport.from_dict(report.to_dict()) == report


def test_figures_against_windows_one_by_one(predictor: Predictor, linear_team: Team) -> None:
    changed = with_peers(predictor, 0.7, invented=0.2)
    data = linear_team(2).episode(60, 51, noise=0.01)
    T_ini, N, past = changed.meta.T_ini, changed.meta.N, changed.meta.past
    du, dy = data.deviations()
    p, r, own = [], [], []
    for k in range(60 - T_ini - N + 1):
        before, after = slice(k, k + T_ini), slice(k + T_ini, k + T_ini + N)
        z = [
            np.concatenate([du[before, j].ravel(), dy[before, j].ravel(), du[after, j].ravel()])
            for j in range(2)
        ]
        for i, j in ((0, 1), (1, 0)):
            p.append((changed.block(i, j)[:, past:] @ z[j][past:]).reshape(N, 6))
            own.append((changed.block(i, i)[:, past:] @ z[i][past:]).reshape(N, 6))
            whole = (changed.block(i, i) @ z[i] + changed.block(i, j) @ z[j]).reshape(N, 6)
            r.append(dy[after, i] - (whole - p[-1]))
    found = peers_figures(changed, [data], LIMIT)
    assert found is not None
    peers, rest, alone = np.array(p), np.array(r), np.array(own)
    for k, name in enumerate(OUTPUTS):
        x, y = peers[..., k].ravel(), rest[..., k].ravel()
        assert found.slope[name].value == pytest.approx(x @ y / (x @ x))
        assert found.harm[name].value == pytest.approx(((y - x) @ (y - x) - y @ y) / (y @ y))
        assert found.share[name] == pytest.approx(np.linalg.norm(x) / np.linalg.norm(alone[..., k]))
        assert found.slope[name][1:] == (None, None), "one block has no interval"


def test_intervals_cover_the_truth_as_often_as_they_say(
    predictor: Predictor, linear_team: Team
) -> None:
    """Nineteen of twenty; fewer than sixteen of twenty would be a chance of one in 400."""
    changed, team = with_peers(predictor, 2.0), linear_team(2)
    inside = 0
    for seed in range(20):
        found = peers_figures(changed, [team.episode(500, 100 + seed, noise=0.3)], LIMIT)
        assert found is not None
        _, low, high = found.slope["vy"]
        assert low is not None
        assert high is not None
        inside += low <= 0.5 <= high
    assert inside >= 16


def test_a_single_robot_has_no_peers(small: Config, linear_team: Team) -> None:
    alone = replace(small, team=replace(small.team, robots=1))
    meta = replace(PredictorMeta.of(alone), ridge=1e-9)
    predictor = fit_ridge([linear_team(1).episode(1500, 1)], meta)
    assert peers_figures(predictor, [linear_team(1).episode(100, 2)], LIMIT) is None


numbers = st.none() | st.floats(-5.0, 5.0)


@given(
    share=numbers,
    slope=st.tuples(numbers, numbers, numbers),
    harm=st.tuples(numbers, numbers, numbers),
)
def test_every_figure_has_a_verdict_and_survives_json(
    share: float | None, slope: tuple[float | None, ...], harm: tuple[float | None, ...]
) -> None:
    figures = PeersFigures({"vx": share}, {"vx": Bounds(*slope)}, {"vx": Bounds(*harm)}, LIMIT)
    words = {"invented", "left out", "understated", "confirmed", "unclear"}
    assert figures.verdict("vx") in words
    assert PeersFigures.from_dict(json.loads(json.dumps(asdict(figures)))) == figures
