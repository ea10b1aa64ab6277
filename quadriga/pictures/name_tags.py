"""The robots' names in a picture, each above its robot and in its colour."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from quadriga.pictures.viewpoint import Viewpoint
from quadriga.shared.robots.colours import robot_colour
from quadriga.shared.robots.conventions import Array

_ABOVE: Final = 0.16  # m over the middle of the trunk
_SIZE: Final = 20  # pixels
_EDGE: Final = 2  # pixels of white around each letter, so that it is read on every ground


def write_names(
    picture: Image.Image, names: Sequence[str], trunks: Array, viewpoint: Viewpoint
) -> None:
    """Write the names of robots into a picture.

    Args:
        picture: taken from `viewpoint`.
        names: of the robots, in the team's order.
        trunks: positions of their trunks, shape (n, 3), m, world.
        viewpoint: of the camera.
    """
    draw, font = ImageDraw.Draw(picture), ImageFont.load_default(size=_SIZE)
    places = viewpoint.project(trunks + np.array([0.0, 0.0, _ABOVE]))
    for index in np.argsort(-places[:, 2], kind="stable").tolist():  # the nearest last, on top
        x, y, depth = places[index].tolist()
        if depth > 0.0:
            draw.text(
                (x, y),
                names[index],
                fill=robot_colour(index),
                font=font,
                anchor="ms",
                stroke_width=_EDGE,
                stroke_fill="white",
            )
