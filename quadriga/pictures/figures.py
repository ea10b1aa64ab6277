"""Figures of a finished walk, as the paper shows them, from the recording alone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from quadriga.recordings.traces import Traces, in_force, read_traces
from quadriga.shared.config.yokes import yoke_pairs
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robot.a1 import OUTPUTS, Array, Leg
from quadriga.shared.wire.messages import Plan
from quadriga.shared.wire.topics import (
    EVENT,
    MEASUREMENT,
    PLAN,
    REFERENCE,
    SAMPLE_MS,
    STATUS,
    TRUTH,
)

TRAJECTORY: Final = "trajectory.png"
FORCES: Final = "forces.png"
TOP_VIEW: Final = "top_view.png"
TIMES: Final = "times.png"
_TOPICS: Final = {topic.name for topic in (TRUTH, REFERENCE, MEASUREMENT, PLAN, STATUS, EVENT)}

_LABELS: Final = (
    r"$z$ [m]", r"$\dot x$ [m/s]", r"$\dot y$ [m/s]", "roll [rad]", "pitch [rad]",
    r"$\omega_z$ [rad/s]",
)  # fmt: skip
# Least range of each panel, so that what is nearly constant does not look like noise.
_SPANS: Final = (0.04, 0.3, 0.2, 0.1, 0.1, 0.4)
_BLUE, _ORANGE, _GREY = "#1f77b4", "#e6550d", "0.55"
_ROBOTS: Final = (
    "#d62728", "#1f77b4", "#2ca02c", "#ff7f0e", "#9467bd",
    "#8c564b", "#e377c2", "#7f7f7f", "#bcbd22", "#17becf",
)  # fmt: skip
_INSTANTS: Final = 6


def draw(run_dir: Path, traces: Traces | None = None) -> tuple[Path, ...]:
    """Write the figures of the run in `run_dir` and return their paths.

    Args:
        run_dir: its folder.
        traces: of its recording, if that has been read already.

    Raises:
        RecordingError: the recording is missing, empty or foreign.
    """
    traces = traces or read_traces(Recording(run_dir / "run.mcap"), _TOPICS)
    return tuple(
        _save(figure, run_dir / name)
        for name, figure in (
            (TRAJECTORY, draw_trajectory(traces)),
            (FORCES, draw_forces(traces)),
            (TOP_VIEW, draw_top_view(traces)),
            (TIMES, draw_times(traces)),
        )
    )


def stitched(plans: Sequence[Plan], applied: int) -> tuple[Array, Array, Array]:
    """The samples of each plan that were applied, one after the other.

    Args:
        plans: plans of one robot, in ascending order of step.
        applied: samples applied of each.

    Returns:
        Time at which each sample begins (k,), s; its forces (k, 12), N, held for 10 ms; and the
        outputs planned for its end (k, 6). A plan shorter than `applied` is passed over.
    """
    plans = [plan for plan in plans if len(plan.u) >= applied]
    if not plans:
        return np.zeros(0), np.zeros((0, 12)), np.zeros((0, 6))
    begin = [plan.tick + SAMPLE_MS * np.arange(applied) for plan in plans]
    return (
        np.concatenate(begin) / 1000.0,
        np.concatenate([plan.u[:applied] for plan in plans]),
        np.concatenate([plan.y[:applied] for plan in plans]),
    )


def draw_trajectory(traces: Traces) -> Figure:
    """Outputs of robot 1: what was asked for, planned, estimated and true."""
    figure = Figure(figsize=(9.0, 7.5), layout="constrained")
    axes = figure.subplots(3, 2, sharex=True)
    robot, truth = traces.robots[0], traces.truth
    time = truth.tick / 1000.0
    reference = in_force(traces.references, truth.tick)
    wanted = np.zeros((len(time), len(OUTPUTS)))
    wanted[:, [1, 2, 5, 0]] = reference
    wanted[np.isnan(reference).any(axis=1)] = np.nan
    begin, _, planned = stitched(traces.plans[robot], traces.config.planner.applied)
    # Half of the panels on each side: z, vx, vy left; roll, pitch, wz right.
    for i, (panel, label) in enumerate(zip(axes.T.flat, _LABELS, strict=True)):
        panel.plot(time, truth.y[:, 0, i], color=_BLUE, linewidth=1.2, label="measured (truth)")
        if len(begin):
            # A gap between plans is left open, as after a stop.
            panel.plot(
                *_broken(begin + SAMPLE_MS / 1000.0, planned[:, i]),
                color=_ORANGE,
                linewidth=1.0,
                label="planned",
            )
        panel.plot(
            time, wanted[:, i], color="black", linewidth=1.0, linestyle="--", label="reference"
        )
        panel.set_ylabel(label)
        _widen(panel, _SPANS[i])
        _tidy(panel)
    for panel in axes[-1]:
        panel.set_xlabel("time [s]")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False)
    return figure


def draw_forces(traces: Traces) -> Figure:
    """Vertical force of robot 1's front-right foot: planned, and thin behind it the true one."""
    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    whole, part = figure.subplots(2, 1)
    truth, leg = traces.truth, Leg.FR
    begin, forces, _ = stitched(traces.plans[traces.robots[0]], traces.config.planner.applied)
    time = truth.tick / 1000.0
    for panel in (whole, part):
        panel.plot(
            time,
            truth.grf[:, 0, leg, 2],
            color=_GREY,
            linewidth=0.7,
            label="ground reaction (truth)",
        )
        if len(begin):
            panel.step(
                *_broken(begin, forces[:, 3 * leg + 2]),
                where="post",
                color=_ORANGE,
                linewidth=1.2,
                label="planned",
            )
        panel.set_ylabel(r"$f_z$ front right [N]")
        panel.set_ylim(bottom=0.0)
        _tidy(panel)
    if len(time):
        whole.set_xlim(time[0], time[-1])
        middle = 0.5 * (time[0] + time[-1])
        stride = 2e-3 * traces.config.gait.stance_ms
        part.set_xlim(middle, middle + 4 * stride)
    part.set_title("four strides, enlarged", fontsize=9, loc="left")
    part.set_xlabel("time [s]")
    handles, labels = whole.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=2, frameon=False)
    return figure


def draw_top_view(traces: Traces) -> Figure:
    """Ways of all trunks from above, and the yokes at some instants."""
    truth, team = traces.truth, traces.config.team
    figure = Figure(figsize=(9.0, 4.5), layout="constrained")
    panel = figure.subplots()
    for i, robot in enumerate(traces.robots):
        panel.plot(*truth.base_pos[:, i, :2].T, color=_ROBOTS[i], linewidth=1.2, label=robot)
    instants = np.linspace(0, len(truth.tick) - 1, min(_INSTANTS, len(truth.tick))).astype(int)
    for k in instants:
        place = truth.base_pos[k, :, :2]
        for i, j in yoke_pairs(team.robots, team.yokes):
            panel.plot(*place[[i, j]].T, color="goldenrod", linewidth=1.2, zorder=1)
        panel.scatter(place[:, 0], place[:, 1], c=_ROBOTS[: len(place)], s=22, zorder=3)
        panel.annotate(
            f"{truth.tick[k] / 1000:.1f} s",
            place[np.argmax(place[:, 1])],
            xytext=(0, 7),
            textcoords="offset points",
            ha="center",
            fontsize=8,
        )
    panel.set_aspect("equal", adjustable="datalim")
    panel.set_xlabel("x [m]")
    panel.set_ylabel("y [m]")
    panel.margins(0.08)
    _tidy(panel)
    figure.legend(loc="outside upper center", ncols=len(traces.robots), frameon=False)
    return figure


def draw_times(traces: Traces) -> Figure:
    """Distribution of planner solve times and control tick times of every robot."""
    figure = Figure(figsize=(9.0, 3.5), layout="constrained")
    panels = figure.subplots(1, 2)
    for panel, field, label in zip(
        panels, ("planner_ms", "tick_us"), ("planner solve [ms]", "control tick [µs]"), strict=True
    ):
        times = [
            np.concatenate([np.zeros(0), *(getattr(s, field) for s in traces.statuses[robot])])
            for robot in traces.robots
        ]
        every = np.concatenate(times)
        if len(every):
            # Beyond the 99.5 % quantile lie single outliers that would flatten the rest.
            high = float(np.quantile(every, 0.995)) * 1.1 + 1e-9
            bins = np.linspace(0.0, high, 60)
            for i, robot in enumerate(traces.robots):
                panel.hist(
                    np.minimum(times[i], high),
                    bins=bins,
                    histtype="step",
                    color=_ROBOTS[i],
                    label=robot,
                )
        else:
            panel.text(0.5, 0.5, "none recorded", transform=panel.transAxes, ha="center")
        panel.set_xlabel(label)
        panel.set_ylabel("count")
        _tidy(panel)
    handles, labels = panels[1].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=10, frameon=False)
    return figure


def _broken(time: Array, values: Array) -> tuple[Array, Array]:
    """The same curve with a gap wherever samples are missing."""
    at = np.flatnonzero(np.diff(time) > 1.5e-3 * SAMPLE_MS) + 1
    return np.insert(time, at, np.nan), np.insert(values, at, np.nan)


def _widen(panel: Any, span: float) -> None:
    low, high = panel.get_ylim()
    if high - low < span:
        middle = 0.5 * (low + high)
        panel.set_ylim(middle - span / 2, middle + span / 2)


def _tidy(panel: Any) -> None:
    panel.spines[["top", "right"]].set_visible(False)
    panel.grid(color="0.92", linewidth=0.6)
    panel.set_axisbelow(True)
    panel.yaxis.set_major_locator(MaxNLocator(5))
    panel.margins(x=0.01)


def _save(figure: Figure, path: Path) -> Path:
    FigureCanvasAgg(figure)
    figure.savefig(path, dpi=150)
    return path
