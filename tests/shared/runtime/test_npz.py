"""Files of arrays are read, and whatever is wrong with one is an error that is expected."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quadriga.shared.runtime.npz import UNREADABLE, as_measured, open_npz


def test_a_damaged_file_raises_what_is_expected(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez_compressed(path, a=np.arange(100.0))
    whole = path.read_bytes()
    with open_npz(path) as archive:
        assert as_measured("a", archive["a"], 1).sum() == 4950.0
    for damaged in (b"", b"PK\x03\x04", whole[:-30], whole[:50] + b"\0" * 40 + whole[90:]):
        path.write_bytes(damaged)
        with pytest.raises(UNREADABLE), open_npz(path) as archive:
            as_measured("a", archive["a"], 1)


@pytest.mark.parametrize("array", [np.array(["x"]), [[1.0]], [np.nan], [2e15]])
def test_what_nobody_measures_is_refused(array: object) -> None:
    with pytest.raises(ValueError, match="x of"):
        as_measured("x", array, 1)


def test_gaps_are_taken_where_they_may_be() -> None:
    assert np.isnan(as_measured("x", [np.nan], 1, gaps=True)).all()
