"""Measured responses as a predictor: of a team whose response at every phase is known."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadriga.agents.predictor.fits import fit_periodic
from quadriga.agents.predictor.measured_response import (
    PulseResponses,
    check_measured_plant,
    fit_measured_response,
    plant_of,
    read_pulse_responses,
    team_of,
    write_pulse_responses,
)
from quadriga.agents.predictor.predictor import PredictorMeta
from quadriga.agents.predictor.store import predictor_sha256
from quadriga.experiments.probe.pulses import pulse_forces
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
    return PulseResponses(ticks, u, y, team_of(meta))


def test_measured_responses_are_the_true_ones(tmp_path: Path) -> None:
    team, file = Trotters(2, ((0, 1), (1, 0))), tmp_path / "responses.npz"
    write_pulse_responses(file, responses_of(team, meta_of(2)))
    meta = meta_of(2, response=str(file))
    predictor = fit_periodic([team.episode(1, 1000)], meta)
    assert predictor.meta.response == str(file)
    for i in range(2):
        for j in range(2):
            for phase in (0, 13, 20):
                truth = true_block(team, meta, i, j, phase)
                off = found_block(predictor, i, j, phase) - truth
                assert np.linalg.norm(off) < 0.03 * np.linalg.norm(truth)
    fitted = fit_periodic([team.episode(1, 1000)], meta_of(2))
    assert predictor_sha256(fitted) != predictor_sha256(predictor)


def test_responses_come_back_from_their_file(tmp_path: Path) -> None:
    written = responses_of(Trotters(1, ()), meta_of(1))
    write_pulse_responses(tmp_path / "responses.npz", written)
    read = read_pulse_responses(tmp_path / "responses.npz")
    for name in ("ticks", "u", "y"):
        np.testing.assert_array_equal(getattr(read, name), getattr(written, name))
    assert read.team == written.team == team_of(meta_of(1))


def test_a_wrong_file_is_one_clear_error(tmp_path: Path) -> None:
    file, team = tmp_path / "responses.npz", Trotters(2, ((0, 1), (1, 0)))
    episodes, meta = [team.episode(1, 1000)], meta_of(2, response=str(file))
    with pytest.raises(PredictorFileError, match="no such file, expected responses that"):
        fit_periodic(episodes, meta)
    file.write_bytes(b"PK\x03\x04 cut off")
    with pytest.raises(PredictorFileError, match=r"identification\.response .*responses\.npz"):
        fit_periodic(episodes, meta)
    write_pulse_responses(file, responses_of(Trotters(1, ()), meta_of(1)))
    with pytest.raises(PredictorFileError, match="a team with robots 1, expected 2"):
        fit_periodic(episodes, meta)
    measured = responses_of(team, meta)
    write_pulse_responses(file, replace(measured, u=measured.u[:, :, :, :-1]))
    with pytest.raises(PredictorFileError, match="measured with another horizon"):
        fit_periodic(episodes, meta)


def test_responses_of_other_motors_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "responses.npz"
    walked = load(overrides={"team.robots": 2, "motors.friction": 0.1})
    measured = responses_of(Trotters(2, ((0, 1), (1, 0))), meta_of(2))
    write_pulse_responses(file, replace(measured, team=measured.team | plant_of(walked)))
    keys = {"team.robots": 2, "identification.response": str(file)}
    check_measured_plant(load(overrides=keys | {"motors.friction": 0.1}))
    with pytest.raises(
        PredictorFileError, match=r"motors {'friction': 0\.1}, expected {'friction'"
    ):
        check_measured_plant(load(overrides=keys))


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("robot", "go1", "robot go1, expected a1"),
        ("yokes", "ring", "yokes ring, expected complete"),
        ("kp_z", 1.0, r"controller {'kp_z': 1\.0}, expected {'kp_z': 400\.0}"),
    ],
)
def test_responses_of_another_team_are_refused(
    tmp_path: Path, key: str, value: Any, message: str
) -> None:
    file, team = tmp_path / "responses.npz", Trotters(2, ((0, 1), (1, 0)))
    measured = responses_of(team, meta_of(2))
    other = team_of(meta_of(2))
    (other["controller"] if key in other["controller"] else other)[key] = value
    write_pulse_responses(file, replace(measured, team=other))
    with pytest.raises(PredictorFileError, match=message):
        fit_periodic([team.episode(1, 1000)], meta_of(2, response=str(file)))


@pytest.mark.parametrize(
    "changes",
    [
        {"team": json.dumps(["r1"])},
        {"team": "[" * 30_000},
        {"ticks": np.zeros(2, dtype="<U3")},
        {"ticks": np.zeros((2, 1))},
        {"u": np.zeros((2, 1, 6, 8))},
        {"u": np.full((2, 1, 6, 8, 12), np.nan)},
        {"y": np.full((2, 1, 6, 8, 1, 6), 1e200)},
        {"y": np.zeros((2, 1, 6, 8, 1, 6), dtype="<M8[s]")},
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


def test_what_a_foreign_team_is_called_is_shown_in_part() -> None:
    meta = meta_of(2)
    responses = responses_of(Trotters(2, ((0, 1), (1, 0))), meta)
    foreign = {**responses.team, "yokes": {"x" * 9000: 1}}
    with pytest.raises(PredictorFileError) as error:
        fit_measured_response(replace(responses, team=foreign), meta)
    assert len(str(error.value)) < 1500


def test_pulses_of_nothing_tell_no_response() -> None:
    meta = meta_of(2)
    responses = responses_of(Trotters(2, ((0, 1), (1, 0))), meta)
    with pytest.raises(PredictorFileError, match="pulses of nothing"):
        fit_measured_response(replace(responses, u=0.0 * responses.u), meta)
