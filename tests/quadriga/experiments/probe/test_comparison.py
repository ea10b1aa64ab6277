"""Figures of predictors whose error is known beforehand."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.agents.gait import phase_of, step_ms
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.experiments.probe.comparison import (
    OF_PREDICTOR,
    compare,
    predict_responses,
    truth_figures,
)
from quadriga.experiments.probe.pulses import DIRECTIONS, pulse_starts
from quadriga.experiments.probe.responses import Responses
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import OUTPUTS, Array

N = 6


def config_of(robots: int) -> Config:
    keys = {"team.robots": robots, "planner.N": N, "planner.T_ini": 2, "planner.applied": 4}
    return load(None, {**keys, "planner.latency_ms": 0})


def predictor_of(config: Config, phases: int = 1, seed: int = 0) -> Predictor:
    """A predictor of no physics at all."""
    meta = replace(PredictorMeta.of(config), phases=phases)
    n = config.team.robots
    random = np.random.default_rng(seed)
    return Predictor(meta, random.normal(size=(phases, n, n, 6 * N, meta.layout.width)))


def truth_of(config: Config, predictor: Predictor) -> Responses:
    """The responses of a team that does what the predictor says, from its blocks one by one."""
    n, starts = config.team.robots, pulse_starts(config)
    random = np.random.default_rng(1)
    u = random.normal(size=(len(starts), n, len(DIRECTIONS), N, 12))
    y = np.empty((len(starts), n, len(DIRECTIONS), N, n, 6))
    for p, start in enumerate(starts.tolist()):
        phase = phase_of(config, start // step_ms(config), predictor.phases)
        for j, d, i in product(range(n), range(len(DIRECTIONS)), range(n)):
            response = predictor.future_block(i, j, phase) @ u[p, j, d].ravel()
            y[p, j, d, :, i] = response.reshape(N, 6)
    return Responses((0,), starts, u, y, 0.1 * y, 0, 1)


@pytest.mark.parametrize(("robots", "phases"), [(1, 1), (2, 1), (3, 2), (3, 5)])
def test_the_truth_itself_has_no_error(robots: int, phases: int) -> None:
    config = config_of(robots)
    predictor = predictor_of(config, phases)
    truth = truth_of(config, predictor)
    figures = compare(truth.y, predict_responses(truth, predictor, config.gait)).overall
    for name in OUTPUTS:
        assert figures["own_error"][name] == pytest.approx(0.0, abs=1e-12)
        assert figures["own_size"][name] == pytest.approx(1.0)
        if robots == 1:
            assert figures["peers_error"][name] is None
            assert figures["peers_size"][name] is None
        else:
            assert figures["peers_error"][name] == pytest.approx(0.0, abs=1e-12)
            assert figures["peers_size"][name] == pytest.approx(1.0)


def test_the_phase_is_that_of_the_walk_not_of_the_predictors_data() -> None:
    config = config_of(2)
    predictor = predictor_of(config, 5)
    truth = truth_of(config, predictor)
    stood = replace(predictor.meta, stand_ms=predictor.meta.stand_ms + 40)
    figures = compare(
        truth.y, predict_responses(truth, replace(predictor, meta=stood), config.gait)
    ).overall
    assert max(value or 0.0 for value in figures["own_error"].values()) < 1e-12


def test_a_wrong_phase_is_an_error() -> None:
    config = config_of(2)
    truth = truth_of(config, predictor_of(config, 2))
    swapped = predictor_of(config, 2)
    swapped = replace(swapped, parts=swapped.G[::-1].copy())
    figures = compare(truth.y, predict_responses(truth, swapped, config.gait)).overall
    assert min(value or 0.0 for value in figures["own_error"].values()) > 1.0


@given(own=st.floats(-3.0, 3.0), peers=st.floats(-3.0, 3.0))
def test_a_factor_is_an_error_of_as_much_and_a_size(own: float, peers: float) -> None:
    """With factor 0: error 1, size 0, as of a predictor that predicts nothing."""
    config = config_of(3)
    truth = truth_of(config, predictor_of(config)).y
    factors = np.where(np.eye(3), own, peers)[None, :, None, None, :, None]
    found = compare(truth, factors * truth)
    every = [found.overall, *found.by_phase, *found.by_direction.values()]
    for figures in every:
        assert set(figures) == set(OF_PREDICTOR)
        for name in OUTPUTS:
            assert figures["own_error"][name] == pytest.approx(abs(own - 1.0), abs=1e-9)
            assert figures["own_size"][name] == pytest.approx(abs(own), abs=1e-9)
            assert figures["peers_error"][name] == pytest.approx(abs(peers - 1.0), abs=1e-9)
            assert figures["peers_size"][name] == pytest.approx(abs(peers), abs=1e-9)
    for i, j in product(range(3), range(3)):
        factor = own if i == j else peers
        pair = found.by_pair[i][j]
        assert pair["error"]["vy"] == pytest.approx(abs(factor - 1.0), abs=1e-9)
        assert pair["size"]["vy"] == pytest.approx(abs(factor), abs=1e-9)


@pytest.mark.parametrize("robots", [2, 3, 5])
def test_a_share_is_of_one_peer_whatever_the_size_of_the_team(robots: int) -> None:
    y = np.ones((4, robots, len(DIRECTIONS), N, robots, 6))
    y *= np.where(np.eye(robots), 1.0, 0.25)[None, :, None, None, :, None]
    predicted: Array = 2.0 * y
    responses = Responses((0, 1), np.arange(4), np.zeros((4, robots, 5, N, 12)), y, 0.1 * y, 0, 1)
    truth, figures = truth_figures(responses), compare(y, predicted).overall
    for name in OUTPUTS:
        assert truth["peers_share_true"][name] == pytest.approx(0.25)
        assert figures["peers_share_predicted"][name] == pytest.approx(0.5)
        assert truth["own_scatter"][name] == pytest.approx(0.1)
        assert truth["peers_scatter"][name] == pytest.approx(0.1)


def test_where_the_truth_has_nothing_there_is_no_relative_error() -> None:
    y = np.ones((1, 2, len(DIRECTIONS), N, 2, 6))
    y[:, [0, 1], :, :, [1, 0], 0] = 0.0
    figures = compare(y, y).overall
    assert figures["peers_error"]["z"] is None
    assert figures["peers_error"]["vx"] == 0.0
    assert figures["peers_share_predicted"]["z"] == 0.0
