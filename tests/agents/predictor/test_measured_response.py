"""Measured responses as a predictor: of a team whose response at every phase is known."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadriga.agents.predictor.measured_response import (
    PulseResponses,
    read_pulse_responses,
    write_pulse_responses,
)
from quadriga.agents.predictor.predictor import PredictorMeta, fit
from quadriga.agents.predictor.store import predictor_sha256
from quadriga.experiments.probe.pulses import pulse_forces
from quadriga.identification.predictors import check_measured_team, measured_team
from quadriga.shared.config.load import load
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


def responses_of(team: Trotters, meta: PredictorMeta) -> PulseResponses:
    """What a probe of the team measures: pulses at ten phases, in every direction."""
    ticks = CONFIG.gait.stand_ms + 40 * np.arange(10)
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
    return PulseResponses(ticks, u, y, {})


def test_measured_responses_are_the_true_ones(tmp_path: Path) -> None:
    file = tmp_path / "responses.npz"
    written = responses_of(TEAM, meta_of(2))
    write_pulse_responses(file, written)
    read = read_pulse_responses(file)
    for name in ("ticks", "u", "y"):
        np.testing.assert_array_equal(getattr(read, name), getattr(written, name))
    meta, data = meta_of(2, response=str(file)), [TEAM.episode(1, 1000)]
    predictor = fit(data, meta)
    for i in range(2):
        for j in range(2):
            for phase in (0, 13, 20):
                truth = true_block(TEAM, meta, i, j, phase)
                off = found_block(predictor, i, j, phase) - truth
                assert np.linalg.norm(off) < 0.03 * np.linalg.norm(truth)
    assert predictor_sha256(fit(data, meta_of(2))) != predictor_sha256(predictor)


def test_a_wrong_file_is_one_clear_error(tmp_path: Path) -> None:
    file = tmp_path / "responses.npz"
    episodes, meta = [TEAM.episode(1, 1000)], meta_of(2, response=str(file))
    with pytest.raises(PredictorFileError, match="no such file, expected responses that"):
        fit(episodes, meta)
    file.write_bytes(b"PK\x03\x04 cut off")
    with pytest.raises(PredictorFileError, match=r"identification\.response .*responses\.npz"):
        fit(episodes, meta)
    measured = responses_of(TEAM, meta)
    for wrong, text in (
        (responses_of(Trotters(1, ()), meta_of(1)), "another team or horizon"),
        (replace(measured, u=measured.u[:, :, :, :-1]), "another team or horizon"),
        (replace(measured, u=0.0 * measured.u), "pulses of nothing"),
    ):
        write_pulse_responses(file, wrong)
        with pytest.raises(PredictorFileError, match=text):
            fit(episodes, meta)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("team.robot", "go1", "robot = 'go1', expected 'a1'"),
        ("team.yokes", "ring", "yokes = 'ring', expected 'complete'"),
        ("controller.kp_z", 100.0, r"controller\.kp_z = 100\.0, expected 400\.0"),
        ("motors.friction", 0.1, r"motors\.friction = 0\.1, expected"),
    ],
)
def test_responses_of_another_team_are_refused(
    tmp_path: Path, key: str, value: Any, message: str
) -> None:
    file, robots = tmp_path / "responses.npz", {"team.robots": 2}
    measured = responses_of(TEAM, meta_of(2))
    keys = robots | {"identification.response": str(file)}
    write_pulse_responses(file, replace(measured, team=measured_team(load(overrides=keys))))
    check_measured_team(load(overrides=keys))
    other = measured_team(load(overrides=robots | {key: value}))
    write_pulse_responses(file, replace(measured, team=other))
    with pytest.raises(PredictorFileError, match=message):
        check_measured_team(load(overrides=keys))


@pytest.mark.parametrize(
    "changes",
    [
        {"team": json.dumps(["r1"])},
        {"team": "[" * 30_000},
        {"ticks": np.zeros(2, dtype="<U3")},
        {"u": np.zeros((2, 1, 6, 8))},
        {"u": np.full((2, 1, 6, 8, 12), np.nan)},
        {"y": np.full((2, 1, 6, 8, 1, 6), 1e200)},
        {"y": np.array("y")},
    ],
)
def test_what_nobody_has_measured_is_no_response(
    changes: Mapping[str, Any], tmp_path: Path
) -> None:
    file, u, y = tmp_path / "responses.npz", np.ones((2, 1, 6, 8, 12)), np.ones((2, 1, 6, 8, 1, 6))
    good: dict[str, Any] = {"ticks": np.array([0, 100]), "u": u, "y": y, "team": "{}"}
    np.savez(file, **good)
    assert read_pulse_responses(file).team == {}
    np.savez(file, **{**good, **changes})
    with pytest.raises(PredictorFileError, match=r"identification\.response"):
        read_pulse_responses(file)
