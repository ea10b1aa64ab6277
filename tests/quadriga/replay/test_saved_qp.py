"""A saved problem is read back and solved; what is none is refused."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadriga.replay.saved_qp import SavedQp, load, save
from quadriga.shared.errors import RecordingError

ONE = np.eye(3)
QP = SavedQp(ONE, -ONE[0], ONE, -np.ones(6), np.ones(6), np.full(3, np.nan), "plan of r1")


def test_a_problem_is_read_back_whatever_came_of_it(tmp_path: Path) -> None:
    save(tmp_path / "qp.npz", QP)
    found = load(tmp_path / "qp.npz")
    assert found.about == "plan of r1"
    np.testing.assert_allclose(found.solve(), ONE[0], atol=1e-9)


@pytest.mark.parametrize(
    "changes",
    [
        {"H": np.eye(4)},
        {"H": np.zeros((2, 2, 2, 2))},
        {"H": np.zeros((3, 3), dtype="<M8[s]")},
        {"f": np.full(3, np.nan)},
        {"A": np.zeros((1 << 10, 3))},
        {"lower": -np.ones(3)},
        {"upper": np.full(6, np.inf)},
        {"x": np.array("x")},
    ],
)
def test_what_is_no_problem_is_refused(changes: Mapping[str, Any], tmp_path: Path) -> None:
    np.savez(tmp_path / "qp.npz", **{**asdict(QP), **changes})
    with pytest.raises(RecordingError, match=r"qp\.npz: got .*, expected a saved problem"):
        load(tmp_path / "qp.npz")
