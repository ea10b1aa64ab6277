"""Curves and bars stand where their values belong."""

from __future__ import annotations

import re
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg

from quadriga.charts.colours import BARS, LINES
from quadriga.charts.draw import WIDTH, draw_panels
from quadriga.charts.files import to_svg
from quadriga.charts.panels import DEGREES, Bars, Curve, Mark, Panel, PanelGrid

TIME = np.linspace(0.0, 10.0, 101)
GRID = PanelGrid(0.0, 10.0, height=100.0)


def box(svg: str, k: int = 0) -> tuple[float, ...]:
    """Left, width, top and height of the k-th panel, points, as the page's script reads them."""
    found = re.search(r'data-panels="([^"]*)"', svg)
    assert found
    return tuple(map(float, found.group(1).split(",")[k].split()))[:4]


def points(axes: Axes, style: str) -> np.ndarray:
    """Points of a curve, as shares of its panel from its lower left corner. Shape (k, 2)."""
    line = next(line for line in axes.lines if line.get_color() == LINES[style]["color"])
    path = line.get_path().transformed(axes.transData - axes.transAxes)
    return np.array(path.vertices)


def corners(axes: Axes, style: str) -> list[tuple[float, float]]:
    """Left and right side of each bar of a style."""
    patch = next(p for p in axes.patches if np.allclose(p.get_facecolor(), _rgba(BARS[style])))
    x = np.array(patch.get_path().vertices)[:, 0].reshape(-1, 5)
    return [(row.min(), row.max()) for row in x]


def _rgba(colour: str) -> list[float]:
    return [*(int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)), 1.0]


def test_a_ramp_goes_from_one_corner_to_the_other() -> None:
    (axes,) = draw_panels([Panel("y", [Curve(TIME, 3.0 * TIME, "own")])], GRID).axes
    x, y = points(axes, "own").T
    assert (x[0], x[-1]) == (pytest.approx(0.0), pytest.approx(1.0))
    assert np.polyfit(x, y, 1)[0] == pytest.approx(1 / 1.12, rel=1e-3)
    assert 0.0 < y[0] < y[-1] < 1.0


def test_what_comes_after_a_fall_does_not_choose_the_axes() -> None:
    values = np.where(TIME > 8.0, 1000.0, np.sin(TIME))
    (axes,) = draw_panels([Panel("y", [Curve(TIME, values, "own")], until=8.0)], GRID).axes
    y = points(axes, "own")[:, 1]
    assert np.ptp(y[:60]) > 0.7
    assert y[-1] > 1.0, "out of the panel, which cuts it off"
    (axes,) = draw_panels([Panel("f", [Curve(TIME, values, "own")], ceiling=2.0)], GRID).axes
    assert points(axes, "own")[-1, 1] > 1.0


def test_a_part_of_the_time_is_drawn_to_the_whole_width() -> None:
    panel = Panel("y", [Curve(TIME, TIME, "own")])
    for shown, grid in (
        (panel, PanelGrid(4.0, 6.0)),
        (Panel("y", panel.curves, part=(4.0, 6.0)), GRID),
    ):
        (axes,) = draw_panels([shown], grid).axes
        inside = [p for p in points(axes, "own")[:, 0] if -1e-4 <= p <= 1.0001]
        assert len(inside) == 21


def test_bars_and_marks_stand_at_their_times() -> None:
    panel = Panel("r1", rows=[Bars("FL", [(2.0, 4.0, "stance"), (20.0, 21.0, "stance")])])
    marks = [Mark(5.0, "fall", "r1 fell"), Mark(11.0, "fall", "no")]
    figure = draw_panels([panel], GRID, marks=marks)
    (axes,) = figure.axes
    assert corners(axes, "stance") == [(2.0, 4.0)]
    (line,) = axes.lines
    assert list(np.asarray(line.get_xdata())) == [5.0, 5.0]
    assert [text.get_text() for text in axes.texts] == ["r1 fell"]


def test_an_instant_is_a_bar_wide_enough_to_be_seen() -> None:
    rows = [Bars("", [(3.0, 3.0, "event"), (5.0, 5.0, "stance")])]
    figure = draw_panels([Panel("", rows=rows)], GRID)
    (axes,) = figure.axes
    point = 10.0 / box(to_svg(figure, "bars"))[1]
    ((low, high),) = corners(axes, "event")
    assert high - low == pytest.approx(3.0 * point, rel=1e-2)
    ((low, high),) = corners(axes, "stance")
    assert high - low == pytest.approx(0.5 * point, rel=1e-2)


@pytest.mark.parametrize("log", [False, True])
def test_nothing_to_draw_draws_nothing(log: bool) -> None:
    empty, unknown = np.zeros(0), np.full(3, np.nan)
    curves = [Curve(empty, empty, "own"), Curve(np.arange(3.0), unknown, "true", "step", 0.1)]
    panels = [Panel("y", curves, log=log), Panel("z"), Panel("w", [curves[0]])]
    figure = draw_panels(panels, PanelGrid(0.0, 0.0))
    assert not any(axes.lines for axes in figure.axes)
    assert "nan" not in to_svg(figure, "nothing")


def test_columns_share_the_width_and_names_are_escaped() -> None:
    svg = to_svg(draw_panels([Panel("a & <b>")] * 3, PanelGrid(0.0, 1.0, columns=2)), '"<&')
    assert box(svg, 0)[2] == box(svg, 1)[2] < box(svg, 2)[2]
    assert box(svg, 1)[0] > box(svg, 0)[0] + box(svg, 0)[1]
    assert svg.count("a &amp; &lt;b&gt;") == 3
    assert 'aria-label="&quot;&lt;&amp;"' in svg


def test_a_legend_takes_as_many_lines_as_it_needs() -> None:
    entries = [("true", f"a rather long name {k}") for k in range(10)]
    figure = draw_panels([Panel("y")], GRID, legend=entries)
    figure.draw_without_rendering()
    boxes = [legend.get_window_extent() for legend in figure.legends]
    assert len(boxes) > 1
    scale = figure.dpi / 72.0
    assert all(box.x1 <= WIDTH * scale for box in boxes)
    assert all(upper.y0 >= lower.y1 - 8 for upper, lower in pairwise(boxes))
    assert boxes[-1].y0 > figure.axes[0].get_window_extent().y1


def test_a_figure_has_a_title_and_a_panel_its_own_axis() -> None:
    panel = Panel("count", [Curve(TIME, TIME, "own")], across="time of a solve [ms]")
    figure = draw_panels([panel], GRID, title="How long it took")
    assert [text.get_text() for text in figure.texts] == ["How long it took"]
    assert figure.axes[0].get_xlabel() == "time of a solve [ms]"


def test_degrees_stand_beside_radians() -> None:
    panel = Panel("roll [rad]", [Curve(TIME, 0.1 * TIME, "own")], beside=DEGREES)
    figure = draw_panels([panel], GRID)
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    ((axes,), (other,)) = figure.axes, figure.axes[0].child_axes
    low, high = axes.get_ylim()
    assert other.get_ylim() == pytest.approx(np.rad2deg([low, high]))
    shown = [label.get_text() for label in other.get_yticklabels()]
    assert "0°" in shown
    assert len(shown) > 2
