"""Means over repetitions, with what falls have taken, and files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadriga.experiments.probe.responses import (
    Repetition,
    average,
    read_repetition,
    write_repetition,
)
from quadriga.shared.errors import PredictorFileError

SHAPE_U, SHAPE_Y = (2, 3, 5, 4, 12), (2, 3, 5, 4, 3, 6)


def repetition(seed: int) -> Repetition:
    random = np.random.default_rng(seed)
    return Repetition(
        seed, np.array([400, 600]), random.normal(size=SHAPE_U), random.normal(size=SHAPE_Y)
    )


def test_the_mean_and_the_scatter_are_those_of_the_repetitions() -> None:
    each = [repetition(seed) for seed in range(4)]
    mean = average(each)
    assert mean is not None
    np.testing.assert_allclose(mean.y, np.mean([r.y for r in each], axis=0))
    np.testing.assert_allclose(mean.u, np.mean([r.u for r in each], axis=0))
    np.testing.assert_allclose(mean.scatter, np.std([r.y for r in each], axis=0, ddof=1))
    assert (mean.seeds, mean.lost, mean.pulses) == ((0, 1, 2, 3), 0, 4 * 2 * 3 * 5)


def test_a_pulse_lost_to_a_fall_is_left_out_of_its_mean_alone() -> None:
    each = [repetition(seed) for seed in range(3)]
    each[1].y[1, 2, 3] = np.nan
    each[1].u[1, 2, 3] = np.nan
    mean = average(each)
    assert mean is not None
    assert mean.lost == 1
    np.testing.assert_allclose(mean.y[1, 2, 3], (each[0].y + each[2].y)[1, 2, 3] / 2)
    np.testing.assert_allclose(mean.u[1, 2, 3], (each[0].u + each[2].u)[1, 2, 3] / 2)
    np.testing.assert_allclose(mean.y[0], np.mean([r.y[0] for r in each], axis=0))


def test_one_repetition_has_no_scatter() -> None:
    mean = average([repetition(0)])
    assert mean is not None
    assert np.isnan(mean.scatter).all()


def test_a_pulse_that_was_never_measured_leaves_no_mean() -> None:
    lost = repetition(0)
    lost.y[0, 0, 0, 3] = np.nan
    assert average([lost]) is None


def test_files_give_back_what_was_written(tmp_path: Path) -> None:
    path, written = tmp_path / "new" / "responses.npz", repetition(7)
    write_repetition(path, written)
    found = read_repetition(path)
    assert found.seed == written.seed
    for name in ("ticks", "u", "y"):
        np.testing.assert_array_equal(getattr(found, name), getattr(written, name))


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 not an archive"])
def test_a_damaged_file_is_one_clear_error(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "responses.npz"
    path.write_bytes(content)
    with pytest.raises(PredictorFileError, match="delete it to measure anew"):
        read_repetition(path)


@pytest.mark.parametrize(
    "changes",
    [
        {"ticks": np.zeros(3)},
        {"u": np.zeros((2, 3, 5, 4, 11))},
        {"u": np.zeros((2, 3, 5, 5, 12))},
        {"u": np.zeros(SHAPE_U, dtype="<U3")},
        {"y": np.zeros((2, 3, 5, 4, 2, 6))},
        {"y": np.full(SHAPE_Y, np.inf)},
        {"y": np.zeros(())},
    ],
)
def test_arrays_that_do_not_belong_together_are_refused(
    changes: Mapping[str, Any], tmp_path: Path
) -> None:
    file = tmp_path / "responses.npz"
    good = {"seed": 1, "ticks": np.zeros(2), "u": np.zeros(SHAPE_U), "y": np.zeros(SHAPE_Y)}
    np.savez(file, **{**good, **changes})
    with pytest.raises(PredictorFileError, match=r"responses\.npz: got .*quadriga probe"):
        read_repetition(file)


def test_repetitions_of_two_teams_have_no_mean() -> None:
    other = Repetition(1, np.array([0]), np.zeros((1, 1, 5, 4, 12)), np.zeros((1, 1, 5, 4, 1, 6)))
    with pytest.raises(PredictorFileError, match="some of the shapes"):
        average([repetition(0), other])
