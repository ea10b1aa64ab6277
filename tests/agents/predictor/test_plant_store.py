"""Predictors are read as they were written, or not at all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quadriga.agents.predictor.four_tank import four_tank
from quadriga.agents.predictor.plant import fit, load, save
from quadriga.shared.errors import PredictorFileError


def test_what_is_saved_is_loaded(tmp_path: Path) -> None:
    example, path = four_tank(noise=0.002), tmp_path / "new" / "tanks.npz"
    predictor = fit(example.data, "ridge", 4, 8)
    save(path, predictor)
    again = load(path)
    np.testing.assert_array_equal(again.blocks, predictor.blocks)
    assert (again.kind, again.layout, again.single) == ("ridge", predictor.layout, True)
    assert again.condition == predictor.condition
    assert [file.name for file in path.parent.iterdir()] == ["tanks.npz"]


def test_damaged_and_foreign_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "tanks.npz"
    with pytest.raises(PredictorFileError, match="no such file"):
        load(path)
    save(path, fit(four_tank().data, "pinv", 4, 8))
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(PredictorFileError, match="something else"):
        load(path)
    np.savez(path, document=np.array('{"format": "another"}'), blocks=np.zeros((1, 1)))
    with pytest.raises(PredictorFileError, match="format another"):
        load(path)
    path.write_bytes(content)
    with np.load(path) as archive:
        np.savez(path, document=archive["document"], blocks=archive["blocks"] + 1.0)
    with pytest.raises(PredictorFileError, match="digest"):
        load(path)
    with pytest.raises(PredictorFileError, match="a file that can be written"):
        save(tmp_path, fit(four_tank().data, "pinv", 4, 8))
