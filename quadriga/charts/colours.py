"""Colours and line styles of all charts."""

from __future__ import annotations

from typing import Any, Final

# Okabe and Ito's colours, which the colour-blind can tell apart. The page's style sheet has the
# same names, with brighter colours where the page is dark.
PALETTE: Final = {
    "paper": "#ffffff", "ink": "#1b1b1b", "soft": "#666666", "line": "#d4d4d4", "grid": "#ececec",
    "blue": "#0072b2", "orange": "#d55e00", "green": "#009e73", "purple": "#b0508c",
    "yellow": "#b8860b", "bad": "#b3261e", "stance": "#cfe3f1",
}  # fmt: skip
_ROBOTS: Final = ("blue", "orange", "green", "purple", "yellow")

# Line properties by the style of a curve or a mark.
LINES: Final[dict[str, dict[str, Any]]] = {
    "true": {"color": PALETTE["blue"], "linewidth": 2.4, "alpha": 0.55},
    "own": {"color": PALETTE["green"], "linewidth": 1.0},
    "planned": {"color": PALETTE["orange"], "linewidth": 1.3},
    "asked": {"color": PALETTE["ink"], "linewidth": 1.0, "linestyle": (0, (5, 3))},
    "fall": {"color": PALETTE["bad"], "linewidth": 1.6, "linestyle": (0, (4, 2))},
    "stopped": {"color": PALETTE["yellow"], "linewidth": 1.4},
    "level": {"color": PALETTE["soft"], "linewidth": 1.0, "linestyle": (0, (2, 3))},
}
# Colours of bars by their style.
BARS: Final = {
    "mode-stand": PALETTE["line"], "mode-walk": PALETTE["stance"],
    "mode-stopping": PALETTE["yellow"], "mode-damping": PALETTE["bad"],
    "mode-estop": PALETTE["bad"], "mode-plan": PALETTE["stance"], "mode-other": PALETTE["soft"],
    "stance": PALETTE["stance"], "contact": PALETTE["blue"], "faded": PALETTE["yellow"],
    "nominal": PALETTE["orange"], "gap": PALETTE["bad"], "count": PALETTE["soft"],
    "event": PALETTE["ink"], "trouble": PALETTE["bad"],
}  # fmt: skip


def robot_style(index: int) -> str:
    """The style of the curves of the robot at `index`; from the sixth on they are dashed."""
    return f"r{index % (2 * len(_ROBOTS))}"


def robot_colour(index: int) -> str:
    """The colour of the robot at `index`."""
    return PALETTE[_ROBOTS[index % len(_ROBOTS)]]


for _index in range(2 * len(_ROBOTS)):
    LINES[robot_style(_index)] = {"color": robot_colour(_index), "linewidth": 1.3}
    if _index >= len(_ROBOTS):
        LINES[robot_style(_index)]["linestyle"] = (0, (4, 2))
