"""Colours as a scene takes them."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import NDArray

_GAMMA: Final = 2.2  # of sRGB, nearly


def rgb_of(colour: str) -> tuple[int, int, int]:
    """A colour of the charts, 0 … 255."""
    red, green, blue = to_rgb(colour)
    return round(255 * red), round(255 * green), round(255 * blue)


def to_linear(colours: Any) -> NDArray[np.uint8]:
    """Colours of sRGB, 0 … 255, as batches and arrows take them: they decode none."""
    return np.rint(255.0 * (np.asarray(colours) / 255.0) ** _GAMMA).astype(np.uint8)
