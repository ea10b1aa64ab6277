"""The curves in the figures are the recorded ones; missing topics leave them empty."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from PIL import Image

from quadriga.charts.colours import LINES, robot_style, truth_style
from quadriga.recordings.applied_plans import join_applied_samples
from quadriga.report.figure_files import write_figures
from quadriga.report.foot_figures import draw_forces_of_first
from quadriga.report.process_figures import draw_time_histograms
from quadriga.report.run import ReportedRun, read_run
from quadriga.report.top_view import draw_top_view
from quadriga.report.trunk_figures import draw_trajectory
from quadriga.shared import messages as msg
from quadriga.shared.robots.colours import robot_colour
from quadriga.shared.robots.conventions import Array
from tests.quadriga.conftest import WriteRun, outputs, run_config

FILES = ("trajectory.png", "forces.png", "top_view.png", "times.png")


@pytest.fixture(scope="session")
def run(known_run: Path) -> ReportedRun:
    return read_run(known_run / "run.mcap")


def curve(panel: Axes, style: str) -> Array:
    """Points of the curve of a style. Shape (2, k)."""
    drawn = {(line.get_color(), line.get_linewidth()): line for line in reversed(panel.lines)}
    line = drawn[LINES[style]["color"], LINES[style]["linewidth"]]
    return np.array(line.get_data(), dtype=float)


def test_four_pictures_with_something_on_them(run: ReportedRun, tmp_path: Path) -> None:
    paths = write_figures(run, tmp_path)
    assert [path.name for path in paths] == list(FILES)
    for path in paths:
        with Image.open(path) as picture:
            assert picture.width > 1000
            assert len(np.unique(np.asarray(picture.convert("L")))) > 50


def test_the_applied_samples_of_each_plan_are_joined() -> None:
    plans = [
        msg.Plan(
            tick,
            tick * 1_000_000,
            tick // 40,
            np.full((25, 12), tick + 0.0),
            tick + np.arange(150.0).reshape(25, 6),
            "solved",
            {},
            0,
        )
        for tick in (400, 440, 520)
    ]
    begin, forces, y = join_applied_samples(plans, 4)
    expected = [400, 410, 420, 430, 440, 450, 460, 470, 520, 530, 540, 550]
    np.testing.assert_allclose(begin, np.array(expected) / 1000)
    np.testing.assert_allclose(forces[:, 0], np.repeat([400, 440, 520], 4))
    np.testing.assert_allclose(y[5], plans[1].y[1])


def test_trajectory_shows_truth_plan_and_reference(run: ReportedRun) -> None:
    panels = draw_trajectory(run, 0).axes
    height, speed = panels[0], panels[2]  # z above vx in the left column
    assert (height.get_title("left"), speed.get_title("left")) == ("z [m]", "vx [m/s]")
    for style, first in ((truth_style(0), run.traces.truth.tick[0]), ("planned", 410)):
        time, z = curve(height, style)
        assert time[0] == pytest.approx(first / 1000)
        known = np.isfinite(time)
        expected = [outputs(round(1000 * t), 0)[0] for t in time[known]]
        np.testing.assert_allclose(z[known], expected, atol=1e-9)
    time, wanted = curve(speed, "asked")
    assert wanted[time > 1.5] == pytest.approx(0.5)
    assert wanted[time < 0.3] == pytest.approx(0.0)


def test_forces_show_the_front_right_leg_of_robot_1(run: ReportedRun) -> None:
    whole, part = draw_forces_of_first(run).axes
    time, true = curve(whole, truth_style(0))
    np.testing.assert_allclose(true, run.traces.truth.grf[:, 0, 1, 2])
    begin, planned = (values[:-1] for values in curve(whole, "planned"))  # the last is held
    at = np.searchsorted(time, begin - 1e-9)
    stance = planned > 0.0
    np.testing.assert_allclose(true[at][stance] - planned[stance], 3.0)
    np.testing.assert_allclose(true[at][~stance], 0.0)
    assert 0.4 < stance.mean() < 0.6
    first, last = part.get_xlim()
    assert last - first == pytest.approx(8e-3 * run.traces.config.gait.stance_ms)


def test_top_view_shows_every_path_and_yoke(run: ReportedRun) -> None:
    (panel,) = draw_top_view(run.traces).axes
    path = curve(panel, robot_style(1)).T
    np.testing.assert_allclose(path, run.traces.truth.base_pos[::5, 1, :2])
    yokes = [line for line in panel.lines if len(np.atleast_1d(line.get_xdata())) == 2]
    assert len(yokes) == 6  # one yoke at six instants
    dots = [line for line in panel.lines if line.get_marker() == "o"]
    assert [line.get_color() for line in dots] == [robot_colour(0), robot_colour(1)]


def test_gaps_between_plans_are_left_open(write_run: WriteRun) -> None:
    folder = write_run(
        run_config(1, 1.0),
        change=lambda _, m: None if isinstance(m, msg.Plan) and 600 <= m.tick < 800 else m,
    )
    time, _ = curve(draw_trajectory(read_run(folder / "run.mcap"), 0).axes[0], "planned")
    assert np.isnan(time).sum() == 1


@pytest.mark.parametrize("lost", [msg.Truth, msg.Plan, msg.Status, msg.Reference])
def test_figures_without_a_topic(
    write_run: WriteRun, lost: type[msg.Message], tmp_path: Path
) -> None:
    folder = write_run(run_config(2, 0.6), change=lambda _, m: None if isinstance(m, lost) else m)
    assert len(write_figures(read_run(folder / "run.mcap"), tmp_path)) == 4


def test_without_times_the_histograms_say_so(write_run: WriteRun) -> None:
    folder = write_run(
        run_config(1, 0.5), change=lambda _, m: None if isinstance(m, msg.Status) else m
    )
    figure = draw_time_histograms(read_run(folder / "run.mcap"))
    assert all("none recorded" in axes.get_title("left") for axes in figure.axes)


def test_a_histogram_counts_every_tick_of_every_robot(run: ReportedRun) -> None:
    ticks = draw_time_histograms(run).axes[1]
    for index, robot in enumerate(run.traces.robots):
        _, counts = curve(ticks, robot_style(index))
        measured = sum(len(status.tick_us) for status in run.traces.statuses[robot])
        assert counts[:-1].sum() == measured  # the last one is held, not counted
