"""The curves in the figures are the recorded ones; missing topics leave them empty."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from PIL import Image

from quadriga.pictures.figures import (
    draw,
    draw_forces,
    draw_times,
    draw_top_view,
    draw_trajectory,
    stitched,
)
from quadriga.recordings.traces import Traces, read_traces
from quadriga.shared.errors import RecordingError
from quadriga.shared.recording.reader import Recording
from quadriga.shared.wire import messages as msg
from tests.quadriga.conftest import WriteRun, outputs, run_config

FILES = ("trajectory.png", "forces.png", "top_view.png", "times.png")


@pytest.fixture(scope="session")
def traces(known_run: Path) -> Traces:
    return read_traces(Recording(known_run / "run.mcap"))


def curve(panel: Axes, label: str) -> np.ndarray:
    """Points of the labelled curve. Shape (2, k)."""
    line = next(line for line in panel.lines if line.get_label() == label)
    return np.array(line.get_data(), dtype=float)


def test_four_pictures_with_something_on_them(known_run: Path) -> None:
    paths = draw(known_run)
    assert [path.name for path in paths] == list(FILES)
    for path in paths:
        with Image.open(path) as picture:
            assert picture.width > 1000
            assert len(np.unique(np.asarray(picture.convert("L")))) > 50


def test_stitching_takes_the_applied_samples_of_each_plan() -> None:
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
    begin, forces, y = stitched(plans, 4)
    expected = [400, 410, 420, 430, 440, 450, 460, 470, 520, 530, 540, 550]
    np.testing.assert_allclose(begin, np.array(expected) / 1000)
    np.testing.assert_allclose(forces[:, 0], np.repeat([400, 440, 520], 4))
    np.testing.assert_allclose(y[5], plans[1].y[1])


def test_trajectory_shows_truth_plan_and_reference(traces: Traces) -> None:
    panels = draw_trajectory(traces).axes
    height, speed = panels[0], panels[2]  # z above vx in the left column
    assert (height.get_ylabel(), speed.get_ylabel()) == (r"$z$ [m]", r"$\dot x$ [m/s]")
    time, z = curve(height, "measured (truth)")
    np.testing.assert_allclose(z, [outputs(round(1000 * t), 0)[0] for t in time], atol=1e-9)
    time, z = curve(height, "planned")
    assert time[0] == pytest.approx(0.41)
    np.testing.assert_allclose(z, [outputs(round(1000 * t), 0)[0] for t in time], atol=1e-9)
    time, wanted = curve(speed, "reference")
    assert wanted[time > 1.5] == pytest.approx(0.5)
    assert wanted[time < 0.3] == pytest.approx(0.0)


def test_forces_show_the_front_right_leg_of_robot_1(traces: Traces) -> None:
    panel = draw_forces(traces).axes[0]
    time, true = curve(panel, "ground reaction (truth)")
    np.testing.assert_allclose(true, traces.truth.grf[:, 0, 1, 2])
    begin, planned = curve(panel, "planned")
    at = np.searchsorted(time, begin - 1e-9)
    stance = planned > 0.0
    np.testing.assert_allclose(true[at][stance] - planned[stance], 3.0)
    np.testing.assert_allclose(true[at][~stance], 0.0)
    assert 0.4 < stance.mean() < 0.6


def test_top_view_shows_every_way_and_yoke(traces: Traces) -> None:
    panel = draw_top_view(traces).axes[0]
    np.testing.assert_allclose(curve(panel, "r2").T, traces.truth.base_pos[:, 1, :2])
    yokes = [line for line in panel.lines if len(np.atleast_1d(line.get_xdata())) == 2]
    assert len(yokes) == 6  # one yoke at six instants


def test_gaps_between_plans_are_left_open(write_run: WriteRun) -> None:
    run = write_run(
        run_config(1, 1.0),
        change=lambda _, m: None if isinstance(m, msg.Plan) and 600 <= m.tick < 800 else m,
    )
    traces = read_traces(Recording(run / "run.mcap"))
    time, _ = curve(draw_trajectory(traces).axes[0], "planned")
    assert np.isnan(time).sum() == 1


@pytest.mark.parametrize("lost", [msg.Truth, msg.Plan, msg.Status, msg.Reference])
def test_figures_without_a_topic(write_run: WriteRun, lost: type[msg.Message]) -> None:
    run = write_run(run_config(2, 0.6), change=lambda _, m: None if isinstance(m, lost) else m)
    traces = read_traces(Recording(run / "run.mcap"))
    for figure in (draw_trajectory, draw_forces, draw_top_view, draw_times):
        figure(traces).draw_without_rendering()


def test_nothing_recorded_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"run\.mcap"):
        draw(tmp_path)
