"""Where a plan leads, in closed form."""

from __future__ import annotations

import numpy as np

from quadriga.export.predicted_path import predict_path

START = np.array([1.0, 2.0, 0.3])


def plan(vx: float, vy: float, wz: float, samples: int) -> np.ndarray:
    return np.tile([0.26, vx, vy, 0.0, 0.0, wz], (samples, 1))


def test_straight_on_it_goes_along_the_heading() -> None:
    path = predict_path(plan(0.5, 0.0, 0.0, 20), START, np.pi / 2)
    np.testing.assert_allclose(path[0], START)
    np.testing.assert_allclose(path[-1], [1.0, 2.1, 0.3], atol=1e-12)


def test_sideways_is_to_the_left() -> None:
    path = predict_path(plan(0.0, 0.2, 0.0, 10), START, 0.0)
    np.testing.assert_allclose(path[-1], [1.0, 2.02, 0.3], atol=1e-12)


def test_turning_it_goes_round_in_a_circle() -> None:
    samples = 628
    path = predict_path(plan(0.5, 0.0, 2 * np.pi / (0.01 * samples), samples), START, 0.4)
    np.testing.assert_allclose(path[-1], START, atol=1e-9)
    size = path.max(axis=0) - path.min(axis=0)
    np.testing.assert_allclose(size[:2], 0.5 * 6.28 / np.pi, rtol=0.01)


def test_heights_are_taken_over_as_changes() -> None:
    y = plan(0.5, 0.0, 0.0, 5)
    y[:, 0] = [0.26, 0.27, 0.28, 0.27, 0.25]
    np.testing.assert_allclose(predict_path(y, START, 0.0)[1:, 2], [0.3, 0.31, 0.32, 0.31, 0.29])
