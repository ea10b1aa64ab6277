"""The colour of each robot of a team, the same in every figure, picture, view and export."""

from __future__ import annotations

from typing import Final

# Blue, orange, violet, wine, salmon, teal, lilac, red, pink, indigo. Any two can be told apart by
# the colour-blind too; those of small teams best. None is the gold of the yokes or the magenta of
# what is planned.
_COLOURS: Final = (
    *("#0078b4", "#e15a00", "#960fff", "#872d4b", "#e19687"),
    *("#0fb4c3", "#d278ff", "#a5000f", "#d25a87", "#4b3cb4"),
)
N_ROBOT_COLOURS: Final = len(_COLOURS)  # larger teams begin anew

Rgb = tuple[float, float, float]


def robot_colour(index: int) -> str:
    """The colour of the robot at `index` of its team, as #rrggbb, sRGB."""
    return _COLOURS[index % N_ROBOT_COLOURS]


def robot_rgb(index: int) -> Rgb:
    """The colour of the robot at `index` of its team as red, green and blue, sRGB, 0 … 1."""
    return to_rgb(robot_colour(index))


def to_rgb(colour: str) -> Rgb:
    """A colour given as #rrggbb as red, green and blue, 0 … 1."""
    red, green, blue = (int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
    return red, green, blue
