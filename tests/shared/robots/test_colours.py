"""Each robot has a colour of its own, which the colour-blind can tell from the others'."""

from __future__ import annotations

import re

import numpy as np
import pytest

from quadriga.shared.robots.colours import N_ROBOT_COLOURS, robot_colour, robot_rgb
from quadriga.shared.robots.conventions import Array

# What linear red, green and blue turn into: Machado, Oliveira and Fernandes (2009), severity 1.
EYES = {
    "normal": np.eye(3),
    "protan": np.array([[0.152, 1.053, -0.205], [0.115, 0.786, 0.099], [-0.004, -0.048, 1.052]]),
    "deutan": np.array([[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]]),
    "tritan": np.array([[1.256, -0.077, -0.179], [-0.078, 0.931, 0.148], [0.005, 0.691, 0.304]]),
}
XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
WHITE = XYZ.sum(axis=1)


def differences(eye: Array) -> Array:
    """CIE 1976 differences between all robots' colours, as an eye sees them; 2 is just seen."""
    srgb = np.array([robot_rgb(i) for i in range(N_ROBOT_COLOURS)])
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    seen = np.clip(linear @ eye.T, 0.0, 1.0) @ XYZ.T / WHITE
    f = np.where(seen > 0.008856, np.cbrt(seen), 7.787 * seen + 16 / 116)
    lab = np.stack([116 * f[:, 1], 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])], axis=1)
    apart: Array = np.linalg.norm(lab[:, None] - lab[None], axis=-1) + 1e3 * np.eye(len(lab))
    return apart


@pytest.mark.parametrize("eye", EYES)
def test_every_eye_tells_the_robots_apart(eye: str) -> None:
    apart = differences(EYES[eye])
    assert apart.min() > 20.0
    assert apart[:5, :5].min() > 35.0, "teams are seldom larger"


def test_a_colour_is_its_robots_in_every_notation() -> None:
    for index in range(2 * N_ROBOT_COLOURS):
        assert re.fullmatch("#[0-9a-f]{6}", robot_colour(index))
        levels = [round(255 * share) for share in robot_rgb(index)]
        assert "#" + "".join(f"{level:02x}" for level in levels) == robot_colour(index)
    assert robot_colour(0) == robot_colour(N_ROBOT_COLOURS)
