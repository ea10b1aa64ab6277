"""Predictors of a campaign: one for each team, and a word where a gate refuses one."""

from __future__ import annotations

from pathlib import Path

import pytest
from rich.console import Console

from quadriga.campaign.job import Job, origin, walk
from quadriga.campaign.plan import Group
from quadriga.campaign.predictors import Fitted, prepared
from tests.quadriga.linear_data import config_of, put_data


def test_predictors_are_made_once_and_refusals_become_rows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    put_data(tmp_path, monkeypatch)
    flat, rough = config_of(), config_of(world__terrain="boxes", world__payload=3.0)
    none, deepc = config_of(planner__kind="none"), config_of(planner__kind="deepc")
    strict = config_of(identification__max_radius=0.01, identification__block_weight=1.0)
    found = prepared([flat, rough, none, deepc, strict], Console(stderr=True))
    assert found[flat] == found[rough]
    assert found[none] == Fitted()
    assert found[flat].path == found[deepc].path
    assert (found[flat].data, len(found[deepc].files)) == (None, 2)
    assert len(list(tmp_path.rglob("predictor-*.npz"))) == 1
    assert "radius of the best-response map" in found[strict].refused
    job = Job(Group("flat", "strict", ()), 3, strict, found[strict], origin())
    row = walk(job)
    assert row.refused == found[strict].refused
    assert (row.success, row.seconds, row.rmse_z) == (False, 0.0, None)
