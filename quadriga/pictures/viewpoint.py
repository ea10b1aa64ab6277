"""From where pictures of a team are taken, and where things then are in them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from quadriga.pictures.frames import FRAME
from quadriga.pictures.poses import Poses
from quadriga.shared.robots.conventions import Array

AZIMUTH: Final = 145.0  # deg, seen from ahead and the left of a team that walks along x
ELEVATION: Final = -24.0  # deg
FIELD: Final = 45.0  # deg, of view, from the lower to the upper edge
_BELOW: Final = 0.11  # m under the middle of the trunks: there the camera looks


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """A camera that looks from `AZIMUTH` and `ELEVATION`, as MuJoCo counts them.

    Attributes:
        target: what it looks at, shape (3,), m, world.
        distance: from there, m.
    """

    target: Array
    distance: float

    @property
    def eye(self) -> Array:
        """Where the camera is, shape (3,), m, world."""
        return self.target - self.distance * _ahead()

    def project(self, points: Array) -> Array:
        """Where points (k, 3) [m, world] are in a picture of the size `FRAME`.

        Returns:
            Shape (k, 3): pixels from the left and from above, and the distance in front of the
            camera, m. What lies behind the camera has no pixels: NaN.
        """
        turn, ahead = np.deg2rad(AZIMUTH), _ahead()
        right = np.array([np.sin(turn), -np.cos(turn), 0.0])
        along = points - self.eye
        depth = along @ ahead
        width, height = FRAME
        scale = 0.5 * height / np.tan(np.deg2rad(FIELD) / 2)
        with np.errstate(invalid="ignore", divide="ignore"):
            shares = np.stack([along @ right, -(along @ np.cross(right, ahead))]) / depth
        shares[:, depth <= 0.0] = np.nan
        x, y = scale * shares + 0.5 * np.array([[width], [height]])
        return np.stack([x, y, depth], axis=1)


def _ahead() -> Array:
    """The direction in which the camera looks, shape (3,)."""
    turn, tilt = np.deg2rad(AZIMUTH), np.deg2rad(ELEVATION)
    return np.array([np.cos(tilt) * np.cos(turn), np.cos(tilt) * np.sin(turn), np.sin(tilt)])


def viewpoints(poses: Poses) -> list[Viewpoint]:
    """One for each pose: the camera moves with the team and shows all of it."""
    distance = 0.6 + 1.3 * poses.radius()
    return [Viewpoint(centre - np.array([0.0, 0.0, _BELOW]), distance) for centre in poses.centre()]
