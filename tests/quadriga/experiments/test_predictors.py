"""Predictors of a campaign: one for each team, and a word where a gate refuses one."""

from __future__ import annotations

from pathlib import Path

import pytest
from rich.console import Console

from quadriga.experiments.campaign.job import TrialJob, walk_trial
from quadriga.experiments.plan import Group
from quadriga.experiments.predictors import Fitted, prepare_predictors
from quadriga.experiments.trial.origin import code_and_libraries
from quadriga.identification.cache import predictor_path
from quadriga.shared.errors import PredictorFileError
from tests.quadriga.linear_data import config_of, put_data


def test_predictors_are_made_once_and_refusals_become_rows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    put_data(tmp_path, monkeypatch)
    flat, rough = config_of(), config_of(world__terrain="boxes", world__payload=3.0)
    none, deepc = config_of(planner__kind="none"), config_of(planner__kind="deepc")
    strict = config_of(identification__max_radius=0.01, identification__block_weight=1.0)
    found = prepare_predictors([flat, rough, none, deepc, strict], Console(stderr=True))
    assert found[flat] == found[rough]
    assert found[none] == Fitted()
    assert found[flat].path == found[deepc].path
    assert (found[flat].data, len(found[deepc].files)) == (None, 2)
    assert len(list(tmp_path.rglob("predictor-*.npz"))) == 1
    assert "radius of the best-response map" in found[strict].refused
    job = TrialJob(Group("flat", "strict", ()), 3, strict, found[strict], code_and_libraries())
    row = walk_trial(job)
    assert row.refused == found[strict].refused
    assert (row.success, row.seconds, row.rmse_z) == (False, 0.0, None)


def test_a_file_that_is_gone_is_an_error_and_no_row(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A row would be kept, and the trial never be walked."""
    put_data(tmp_path, monkeypatch)
    config = config_of()
    gone = Fitted(tmp_path / "gone.npz", "ab" * 32)
    with pytest.raises(PredictorFileError, match="no such file"):
        walk_trial(
            TrialJob(Group("flat", "distributed", ()), 3, config, gone, code_and_libraries())
        )
    predictor_path(config).write_bytes(b"not a predictor")
    with pytest.raises(PredictorFileError, match="a predictor that quadriga wrote"):
        prepare_predictors([config], Console(stderr=True))
