"""What Foxglove shows of an export: a layout to be imported."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final

from quadriga.charts.colours import PALETTE
from quadriga.export.scene import WORLD
from quadriga.export.source import Source
from quadriga.shared.robots.colours import robot_colour
from quadriga.shared.robots.conventions import Leg, robot_names
from quadriga.shared.runtime.atomic import write_text
from quadriga.shared.topics import MEASUREMENT, PLAN, STATUS, TRUTH

_OUTPUTS: Final = (  # title, path below `tracking.true.`, reference, factor's modifier
    ("z [m]", "z", "height", ""),
    ("roll [°]", "roll", "", ".@rad2deg"),
    ("vx [m/s]", "vx", "vx", ""),
    ("pitch [°]", "pitch", "", ".@rad2deg"),
    ("vy [m/s]", "vy", "vy", ""),
    ("wz [°/s]", "wz", "wz", ".@rad2deg"),
)
_GREY: Final = "#8c8c8c"
_SCENE: Final = ("/scene/robots", "/scene/terrain", "/scene/forces")

Line = tuple[str, str, str, float]  # path, label, colour, width in pixels


def write_layout(source: Source, out: Path) -> None:
    """Write the layout of an export.

    Raises:
        OSError: the file cannot be written.
    """
    write_text(out, json.dumps(build_layout_file(source), indent=1, ensure_ascii=False) + "\n")


def build_layout_file(source: Source) -> dict[str, Any]:
    """The content of a layout: the scene above events and modes, beside tabs of plots."""
    panels = _Panels()
    robots, topics = robot_names(source.config.team.robots), source.topics
    words = [panels.add("RosOut", topicToRender="/events", searchTerms=[], minLogLevel=1)]
    if STATUS.name in topics:
        words.append(_modes(panels, robots))
    left = _split(words, "row")
    if TRUTH.name in topics:
        left = _split([_scene(panels, robots), left], "column", 75)
    tabs = []
    for index, robot in enumerate(robots):
        if MEASUREMENT.name in topics:
            tabs.append((robot, _grid(_plot_outputs(panels, index, robot))))
        if PLAN.name in topics:
            tabs.append((f"{robot} forces", _grid(_plot_forces(panels, index, robot, topics))))
    if STATUS.name in topics:
        tabs.append(("times", _grid(_plot_times(panels, robots))))
    layout = left
    if tabs:
        shown = [{"title": title, "layout": part} for title, part in tabs]
        layout = _split([left, panels.add("Tab", activeTabIdx=0, tabs=shown)], "row")
    return {
        "configById": panels.configs,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": layout,
    }


class _Panels:
    """Configurations of panels by the names that the layout gives them."""

    def __init__(self) -> None:
        self.configs: dict[str, dict[str, Any]] = {}

    def add(self, kind: str, **config: Any) -> str:
        name = f"{kind}!quadriga{len(self.configs)}"
        self.configs[name] = config
        return name

    def plot(self, title: str, lines: Iterable[Line]) -> str:
        """Curves over world time."""
        paths = [
            {
                "value": path,
                "label": label,
                "color": colour,
                "lineSize": width,
                "enabled": True,
                "showLine": True,
                "timestampMethod": "receiveTime",
            }
            for path, label, colour, width in lines
        ]
        return self.add(
            "Plot",
            foxglovePanelTitle=title,
            paths=paths,
            xAxisVal="timestamp",
            isSynced=True,
            showXAxisLabels=True,
            showYAxisLabels=True,
            showLegend=True,
            legendDisplay="floating",
        )


def _scene(panels: _Panels, robots: Sequence[str]) -> str:
    return panels.add(
        "3D",
        foxglovePanelTitle="the team",
        cameraState={
            "perspective": True,
            "distance": 3.5,
            "phi": 62.0,
            "thetaOffset": 125.0,
            "target": [0, 0, 0],
            "targetOffset": [0, 0, 0],
            "targetOrientation": [0, 0, 0, 1],
            "fovy": 45,
            "near": 0.05,
            "far": 500,
        },
        followMode="follow-position",
        followTf=f"{robots[0]}/trunk",
        scene={"transforms": {"visible": False, "showLabel": False}},
        topics={topic: {"visible": True} for topic in _SCENE},
        layers={
            "grid": {
                "layerId": "foxglove.Grid",
                "instanceId": "grid",
                "label": "ground",
                "frameId": WORLD,
                "visible": True,
                "size": 40,
                "divisions": 80,
                "lineWidth": 1,
                "color": "#80808080",
                "position": [0, 0, 0],
                "rotation": [0, 0, 0],
            }
        },
    )


def _modes(panels: _Panels, robots: Sequence[str]) -> str:
    paths = [
        {"value": f"/{robot}/status.mode", "label": robot, "timestampMethod": "receiveTime"}
        for robot in robots
    ]
    return panels.add("StateTransitions", foxglovePanelTitle="modes", paths=paths, isSynced=True)


def _plot_outputs(panels: _Panels, index: int, robot: str) -> list[str]:
    plots = []
    for title, output, reference, turned in _OUTPUTS:
        path = f"/{robot}/tracking"
        lines = [
            (f"{path}.true.{output}{turned}", "true", robot_colour(index), 2.5),
            (f"{path}.estimated.{output}{turned}", "estimated", _GREY, 1.0),
            (f"{path}.planned.{output}{turned}", "planned", PALETTE["purple"], 1.0),
        ]
        if reference:
            asked = f"{path}.reference.{reference}{turned}"
            lines.append((asked, "asked for", PALETTE["yellow"], 1.0))
        plots.append(panels.plot(f"{robot}: {title}", lines))
    return plots


def _plot_forces(panels: _Panels, index: int, robot: str, topics: Iterable[str]) -> list[str]:
    plots = []
    for leg in Leg:
        planned = f"/{robot}/plan.samples[0].u.{leg.name}.z"
        lines = [(planned, "planned", PALETTE["purple"], 1.0)]
        if TRUTH.name in topics:
            true = f"/sim/truth.{robot}.grf.{leg.name}.z"
            lines.insert(0, (true, "true", robot_colour(index), 2.5))
        plots.append(panels.plot(f"{robot} {leg.name}: vertical force [N]", lines))
    return plots


def _plot_times(panels: _Panels, robots: Sequence[str]) -> list[str]:
    titles = (("planner_ms", "planner solve [ms]"), ("tick_us", "control tick [µs]"))
    return [
        panels.plot(
            title,
            [
                (f"/{robot}/status.{field}[0]", robot, robot_colour(index), 1.5)
                for index, robot in enumerate(robots)
            ],
        )
        for field, title in titles
    ]


def _grid(panels: Sequence[str]) -> Any:
    """Panels in rows of two."""
    rows = [_split(panels[k : k + 2], "row") for k in range(0, len(panels), 2)]
    return _split(rows, "column")


def _split(parts: Sequence[Any], direction: str, share: float = 0.0) -> Any:
    """Parts beside each other (`row`) or below each other (`column`), by default equally large."""
    first, *rest = parts
    if not rest:
        return first
    return {
        "direction": direction,
        "first": first,
        "second": _split(rest, direction),
        "splitPercentage": share or 100 / len(parts),
    }
