"""What came of a walk on the desk, from what the robots said and where they truly were."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quadriga.desk.outcome import describe_walk, read_truth, time_kept, time_to_rest, traces_of
from quadriga.desk.robots import Said
from quadriga.shared.messages import Truth
from quadriga.sim_server.emulator.process import LOST, TRUTH_COLUMNS, truth_row

NAMES = ("r1", "r2")


def truth_at(ms: int) -> Truth:
    """Two trunks: one walks ahead at 0.5 m/s, one rolls by 1 rad in a second."""
    s = 1e-3 * ms
    half = 0.5 * s
    return Truth(
        ms,
        ms * 1_000_000,
        NAMES,
        np.array([[0.5 * s, 0.0, 0.3], [0.0, 1.0, 0.3]]),
        np.array([[1.0, 0.0, 0.0, 0.0], [np.cos(half), np.sin(half), 0.0, 0.0]]),
        np.array([[0.5, 0.0, 0.0], [0.0, 0.0, 0.0]]),
        np.array([[0.0, 0.0, 0.1], [1.0, 0.0, 0.0]]),
        np.zeros((2, 4, 3)),
        np.zeros(1),
        np.zeros(1),
    )


@pytest.fixture
def truths() -> list[Truth]:
    return [truth_at(ms) for ms in range(0, 1001, 10)]


def test_the_file_of_truth_and_a_recorded_truth_are_the_same_traces(
    truths: list[Truth], tmp_path: Path
) -> None:
    path = tmp_path / "truth.csv"
    header = ["ms", *(f"{name}_{column}" for name in NAMES for column in TRUTH_COLUMNS)]
    rows = [[truth.tick, *truth_row(truth)] for truth in truths]
    np.savetxt(path, rows, fmt="%.6f", delimiter=",", header=",".join(header), comments="")
    for read, recorded in zip(read_truth(path, NAMES).values(), traces_of(truths), strict=True):
        for field in ("ms", "xyz", "rpy", "velocity"):
            np.testing.assert_allclose(getattr(read, field), getattr(recorded, field), atol=1e-5)


def test_the_share_of_real_time_that_was_kept() -> None:
    said = [Said(s, f"{ms} ms {LOST}") for s, ms in ((1000, 500), (3000, 25), (5000, 75))]
    assert time_kept(said, 1500, 2500) == pytest.approx(1000 / 1025, abs=1e-4)
    assert time_kept(said, 3500, 3900) == 1.0
    assert time_kept(said, 2000, 4900) == pytest.approx(2900 / 3000, abs=1e-4)


def test_figures_of_a_steady_walk(truths: list[Truth]) -> None:
    walker, roller = traces_of(truths)
    figures = describe_walk(walker, 200.0, 800.0)
    assert figures["vx"] == pytest.approx(0.5)
    assert figures["distance"] == pytest.approx(0.3)
    assert figures["wz_rms"] == pytest.approx(0.1)
    assert figures["roll_rms"] == 0.0
    ramp = np.arange(0.2, 0.801, 0.01)
    assert describe_walk(roller, 200.0, 800.0)["roll_rms"] == pytest.approx(
        float(np.sqrt(np.mean(ramp**2)))
    )
    assert describe_walk(walker, 2000.0, 3000.0) == {}


def test_the_tilt_after_a_moment(truths: list[Truth]) -> None:
    walker, roller = traces_of(truths)
    assert walker.tilt(0.0) == 0.0
    assert roller.tilt(0.0, 500.0) == pytest.approx(0.5)
    assert roller.tilt(300.0) == pytest.approx(1.0)


def test_the_time_to_rest_is_that_of_the_robot_after_the_moment() -> None:
    said = [
        Said(10, "r1 motors damped"),
        Said(120, "r2 motors damped"),
        Said(130, "r1 motors driven"),
        Said(150, "r1 motors off"),
    ]
    assert time_to_rest(said, "r1", 100) == 50
    assert time_to_rest(said, "r2", 100) == 20
    assert time_to_rest(said, "r2", 121) is None
