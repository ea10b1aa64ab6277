"""Colours and line styles of all charts."""

from __future__ import annotations

from typing import Any, Final

from quadriga.shared.robots.colours import N_ROBOT_COLOURS, robot_colour

# The page's style sheet has the same names, with brighter colours where the page is dark. The
# robots' colours stand for robots alone.
PALETTE: Final = {
    "paper": "#ffffff", "ink": "#1b1b1b", "soft": "#666666", "line": "#d4d4d4", "grid": "#ececec",
    "blue": "#0072b2", "orange": "#d55e00", "green": "#009e73", "purple": "#b0508c",
    "yellow": "#b8860b", "bad": "#b3261e", "stance": "#dfe3e6", "walk": "#bfe0cf",
    **{f"robot-{i + 1}": robot_colour(i) for i in range(N_ROBOT_COLOURS)},
}  # fmt: skip
# Of what is compared and is no robot: variants, predictors.
_SERIES: Final = (
    "#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#17becf", "#8c564b", "#e377c2",
    "#7f7f7f", "#bcbd22", "#000000",
)  # fmt: skip
_WIDE, _VEIL = 2.6, 0.6  # width in points and opacity of what is true
_DASHES: Final = ("solid", (0, (4, 2)), (0, (1, 1.5)))
_YOKES: Final = ("yellow", "ink", "soft")  # a yoke belongs to two robots, so to no one's colour

# Line properties by the style of a curve or a mark. What is true of a robot is wide and has its
# colour; a figure of several robots explains that by a wide grey line.
LINES: Final[dict[str, dict[str, Any]]] = {
    "true": {"color": PALETTE["soft"], "linewidth": _WIDE, "alpha": _VEIL},
    "own": {"color": PALETTE["ink"], "linewidth": 0.9},
    "planned": {"color": PALETTE["purple"], "linewidth": 1.3},
    "asked": {"color": PALETTE["ink"], "linewidth": 1.0, "linestyle": (0, (5, 3))},
    "fall": {"color": PALETTE["bad"], "linewidth": 1.6, "linestyle": (0, (4, 2))},
    "stopped": {"color": PALETTE["yellow"], "linewidth": 1.4},
    "level": {"color": PALETTE["soft"], "linewidth": 1.0, "linestyle": (0, (2, 3))},
}
# Colours of bars by their style.
BARS: Final[dict[str, str]] = {
    "mode-stand": PALETTE["line"], "mode-walk": PALETTE["walk"],
    "mode-stopping": PALETTE["yellow"], "mode-damping": PALETTE["bad"],
    "mode-estop": PALETTE["bad"], "mode-plan": PALETTE["walk"], "mode-other": PALETTE["soft"],
    "stance": PALETTE["stance"], "contact": PALETTE["soft"], "faded": PALETTE["yellow"],
    "nominal": PALETTE["orange"], "gap": PALETTE["bad"], "count": PALETTE["soft"],
    "event": PALETTE["ink"], "trouble": PALETTE["bad"],
}  # fmt: skip


def robot_style(index: int) -> str:
    """The style of the curves of the robot at `index`; from the sixth on they are dashed."""
    return f"r{index % N_ROBOT_COLOURS + 1}"


def truth_style(index: int) -> str:
    """The style of what is true of the robot at `index`, where other curves lie over it."""
    return f"{robot_style(index)}-true"


def broad_style(index: int) -> str:
    """The style of a curve of the robot at `index` over which another, equal one can be seen."""
    return f"{robot_style(index)}-broad"


def contact_style(index: int) -> str:
    """The style of the bars of contact of the robot at `index`."""
    return f"{robot_style(index)}-contact"


def yoke_style(index: int) -> str:
    """The style of the curves of the yoke at `index`."""
    return f"yoke-{index % (len(_YOKES) * len(_DASHES)) + 1}"


def series_colour(index: int) -> str:
    """The colour of one of several things that are compared and are no robots."""
    return _SERIES[index % len(_SERIES)]


for _index in range(N_ROBOT_COLOURS):
    _colour, _many = robot_colour(_index), _index >= N_ROBOT_COLOURS // 2
    _dash = {"linestyle": _DASHES[1]} if _many else {}
    LINES[robot_style(_index)] = {"color": _colour, "linewidth": 1.3, **_dash}
    LINES[truth_style(_index)] = {"color": _colour, "linewidth": _WIDE, "alpha": _VEIL}
    LINES[broad_style(_index)] = {"color": _colour, "linewidth": 2 * _WIDE}
    BARS[contact_style(_index)] = _colour
for _index in range(len(_YOKES) * len(_DASHES)):
    LINES[yoke_style(_index)] = {
        "color": PALETTE[_YOKES[_index % len(_YOKES)]],
        "linestyle": _DASHES[_index // len(_YOKES)],
        "linewidth": 1.3,
    }
