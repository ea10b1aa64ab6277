"""What Rerun shows when it opens a recording: its blueprint."""

from __future__ import annotations

from typing import Any, Final

import rerun.blueprint as rrb

from quadriga.export.rerun_curves import EVENTS, TITLES
from quadriga.export.rerun_log import TIME
from quadriga.export.rerun_scene import WORLD
from quadriga.recordings.traces import Traces
from quadriga.shared.robots.conventions import OUTPUTS, Leg

_ORDER: Final = (0, 3, 1, 4, 2, 5)  # of the outputs, two in a row: z roll, vx pitch, vy wz


def build_blueprint(traces: Traces, seen: bool) -> rrb.Blueprint:
    """The scene above events and modes; beside it a tab for the team and tabs for each robot.

    Args:
        traces: of the recording.
        seen: whether there is a scene: of real robots nobody knows where they were.
    """
    robots = traces.robots
    words = rrb.Horizontal(
        rrb.TextLogView(
            origin=EVENTS,
            name="events",
            columns=rrb.TextLogColumns(text_log_columns=["loglevel", "body"]),
        ),
        rrb.StateTimelineView(
            origin="/", contents=[f"/{robot}/mode" for robot in robots], name="modes"
        ),
    )
    left: Any = words
    if seen:
        scene = rrb.Spatial3DView(origin=WORLD, name="the team", line_grid=True)
        left = rrb.Vertical(scene, words, row_shares=[3, 1])
    tabs = [_team_tab(traces, "true" if seen else "estimated")]
    for robot in robots:
        tabs += [_outputs_tab(robot), _forces_tab(robot)]
    tabs.append(_times_tab(robots))
    right = rrb.Tabs(*tabs, active_tab=0)
    return rrb.Blueprint(
        rrb.Horizontal(left, right, column_shares=[1, 1]),
        rrb.TimePanel(timeline=TIME, state="collapsed"),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="collapsed"),
    )


def _team_tab(traces: Traces, source: str) -> Any:
    """Each output of all robots, against what was asked of them."""
    views = []
    for k in _ORDER:
        paths = [f"/{robot}/{OUTPUTS[k]}/{source}" for robot in traces.robots]
        paths.append(f"/{traces.robots[0]}/{OUTPUTS[k]}/asked")
        views.append(_plot("/", TITLES[k], k == _ORDER[0], contents=paths))
    return rrb.Grid(*views, grid_columns=2, name="team")


def _outputs_tab(robot: str) -> Any:
    views = [
        _plot(f"/{robot}/{OUTPUTS[k]}", f"{robot}: {TITLES[k]}", k == _ORDER[0]) for k in _ORDER
    ]
    return rrb.Grid(*views, grid_columns=2, name=robot)


def _forces_tab(robot: str) -> Any:
    views = [
        _plot(f"/{robot}/force/{leg.name}", f"{robot} {leg.name}: vertical force [N]", True)
        for leg in Leg
    ]
    return rrb.Grid(*views, grid_columns=2, name=f"{robot} forces")


def _times_tab(robots: tuple[str, ...]) -> Any:
    """What planner and control took, by the wall, and how old inputs were, by world time."""
    views = []
    for robot in robots:
        views += [
            _plot(f"/{robot}/times/planner_ms", f"{robot}: longest planner solve [ms]", False),
            _plot(f"/{robot}/times/tick_us", f"{robot}: longest control tick [µs]", False),
            _plot(f"/{robot}/ages", f"{robot}: ages of inputs [ms]", True),
        ]
    return rrb.Grid(*views, grid_columns=3, name="times")


def _plot(origin: str, name: str, legend: bool, contents: Any = "$origin/**") -> Any:
    """Curves over time; a legend covers some of them, so not each of many plots has one."""
    return rrb.TimeSeriesView(
        origin=origin, contents=contents, name=name, plot_legend=rrb.PlotLegend(visible=legend)
    )
