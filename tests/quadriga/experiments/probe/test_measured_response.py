"""Measured responses as a predictor: of a team whose response at every phase is known."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadriga.agents.predictor.predictor import fit
from quadriga.experiments.probe.measured_response import (
    fit_measured_response,
    write_measured_response,
)
from quadriga.experiments.probe.pulses import pulse_forces
from quadriga.experiments.probe.responses import Responses
from quadriga.identification.predictors import read_response
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorFileError
from tests.agents.predictor.test_periodic import (
    CONFIG,
    N,
    Trotters,
    found_block,
    meta_of,
    true_block,
)

HOLD = 2  # samples that a pulse lasts
TEAM = Trotters(2, ((0, 1), (1, 0)))


def responses_of(team: Trotters) -> Responses:
    """What a probe of the team measures: pulses at ten phases, in every direction."""
    meta, ticks = meta_of(team.robots), CONFIG.gait.stand_ms + 40 * np.arange(10)
    us, ys = [], []
    for tick in ticks.tolist():
        for robot in range(team.robots):
            for force in pulse_forces(CONFIG, robot, tick):
                du = np.zeros((N, team.robots, 12))
                du[:HOLD, robot] = force
                us.append(du[:, robot])
                ys.append(team.respond(meta, du, tick + 10))
    shape = (len(ticks), team.robots, -1)
    u, y = np.array(us), np.array(ys)
    u, y = u.reshape(*shape, *u.shape[1:]), y.reshape(*shape, *y.shape[1:])
    return Responses((0,), ticks, u, y, 0.0 * y, 0, len(us))


def config_of(file: Path, **keys: Any) -> Config:
    named = {"team.robots": 2, "planner.N": N, "planner.T_ini": 4}
    return load(overrides=named | {"identification.response": str(file)} | keys)


def test_measured_responses_are_the_true_ones(tmp_path: Path) -> None:
    file = tmp_path / "responses.npz"
    config = config_of(file)
    write_measured_response(file, responses_of(TEAM), config)
    response = read_response(config)
    np.testing.assert_array_equal(response, fit_measured_response(responses_of(TEAM), config))
    meta = meta_of(2)
    predictor = fit([TEAM.episode(1, 1000)], meta, response=response)
    for i in range(2):
        for j in range(2):
            for phase in (0, 13, 20):
                truth = true_block(TEAM, meta, i, j, phase)
                off = found_block(predictor, i, j, phase) - truth
                assert np.linalg.norm(off) < 0.03 * np.linalg.norm(truth)


def test_no_response_is_read_that_is_not_configured() -> None:
    assert read_response(load()) is None


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("team.robot", "go1", "robot = 'a1', expected 'go1'"),
        ("team.yokes", "ring", "yokes = 'complete', expected 'ring'"),
        ("controller.kp_z", 100.0, r"controller\.kp_z = 400\.0, expected 100\.0"),
        ("motors.friction", 0.1, r"motors\.friction = .*, expected 0\.1"),
        ("planner.N", N + 1, "another horizon"),
    ],
)
def test_responses_of_another_team_are_refused(
    tmp_path: Path, key: str, value: Any, message: str
) -> None:
    file = tmp_path / "responses.npz"
    write_measured_response(file, responses_of(TEAM), config_of(file))
    with pytest.raises(PredictorFileError, match=message):
        read_response(config_of(file, **{key: value}))


@pytest.mark.parametrize(
    "changes",
    [
        {"team": json.dumps(["r1"])},
        {"team": "[" * 30_000},
        {"response": np.zeros((8, N, 2, 6, 2, 6), dtype="<U3")},
        {"response": np.zeros((8, N, 2, 6, 2))},
        {"response": np.full((8, N, 2, 6, 2, 6), np.nan)},
        {"response": np.full((8, N, 2, 6, 2, 6), 1e200)},
        {},
    ],
)
def test_what_nobody_has_measured_is_no_response(
    changes: Mapping[str, Any], tmp_path: Path
) -> None:
    file = tmp_path / "responses.npz"
    if changes:
        np.savez(file, **{"response": np.zeros((8, N, 2, 6, 2, 6)), "team": "{}", **changes})
    with pytest.raises(PredictorFileError, match=r"identification\.response .*responses\.npz"):
        read_response(config_of(file))
