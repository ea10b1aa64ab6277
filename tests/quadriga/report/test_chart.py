"""Curves and bars stand where their values belong."""

from __future__ import annotations

import re

import numpy as np
import pytest

from quadriga.report.chart import draw
from quadriga.report.panel import Bars, Curve, Mark, Panel

TIME = np.linspace(0.0, 10.0, 101)


def box(svg: str, k: int = 0) -> tuple[float, ...]:
    """Left, width, top and height of the k-th panel, px, as the page's script reads them."""
    found = re.search(r'data-p="([^"]*)"', svg)
    assert found
    return tuple(map(float, found.group(1).split(",")[k].split()))


def points(svg: str, style: str) -> np.ndarray:
    """Points of a curve in its panel, px. Shape (k, 2)."""
    found = re.search(rf'class="curve line {style}" d="M([^"]*)"', svg)
    assert found
    numbers = [int(word) for word in re.findall(r"-?\d+", found.group(1))]
    return np.cumsum(np.array(numbers).reshape(-1, 2), axis=0) / 10


def test_a_ramp_goes_from_one_corner_to_the_other() -> None:
    svg = draw([Panel("y", [Curve(TIME, 3.0 * TIME, "own")])], 0.0, 10.0, height=100.0)
    _, width, _, height = box(svg)
    x, y = points(svg, "own").T
    assert (x[0], x[-1]) == (pytest.approx(0.0, abs=0.1), pytest.approx(width, abs=0.1))
    assert np.polyfit(x, y, 1)[0] == pytest.approx(-height / 1.12 / width, rel=1e-3)
    assert 0.0 < y[-1] < y[0] < height


def test_what_comes_after_a_fall_does_not_choose_the_axes() -> None:
    values = np.where(TIME > 8.0, 1000.0, np.sin(TIME))
    svg = draw([Panel("y", [Curve(TIME, values, "own")], until=8.0)], 0.0, 10.0, height=100.0)
    y = points(svg, "own")[:, 1]
    assert np.ptp(y[:60]) > 70.0
    assert y[-1] < 0.0, "out of the panel, which cuts it off"
    bounded = draw([Panel("f", [Curve(TIME, values, "own")], ceiling=2.0)], 0.0, 10.0)
    assert points(bounded, "own")[-1, 1] < 0.0


def test_a_part_of_the_time_is_drawn_to_the_whole_width() -> None:
    svg = draw([Panel("y", [Curve(TIME, TIME, "own")])], 4.0, 6.0)
    _, width, _, _ = box(svg)
    inside = [p for p in points(svg, "own")[:, 0] if -0.1 <= p <= width + 0.1]
    assert len(inside) == 21


def test_bars_and_marks_stand_at_their_times() -> None:
    panel = Panel("r1", rows=[Bars("FL", [(2.0, 4.0, "stance"), (20.0, 21.0, "stance")])])
    svg = draw([panel], 0.0, 10.0, marks=[Mark(5.0, "fall", "r1 fell"), Mark(11.0, "fall", "no")])
    left, width, top, _ = box(svg)
    bars = re.findall(r'class="bar stance"[^>]*d="M(\d+) \d+h(\d+)', svg)
    assert len(bars) == 1
    assert float(bars[0][0]) / 10 == pytest.approx(left + 0.2 * width, abs=0.1)
    assert float(bars[0][1]) / 10 == pytest.approx(0.2 * width, abs=0.1)
    (line,) = re.findall(r'<path class="fall" d="M([\d.]+) ([\d.]+)v', svg)
    assert float(line[0]) == pytest.approx(left + 0.5 * width, abs=0.1)
    assert float(line[1]) == top
    assert "r1 fell" in svg
    assert ">no<" not in svg


@pytest.mark.parametrize("log", [False, True])
def test_nothing_to_draw_draws_nothing(log: bool) -> None:
    empty, unknown = np.zeros(0), np.full(3, np.nan)
    curves = [Curve(empty, empty, "own"), Curve(np.arange(3.0), unknown, "true", "step", 0.1)]
    svg = draw([Panel("y", curves, log=log), Panel("z"), Panel("w", [curves[0]])], 0.0, 0.0)
    assert 'class="curve' not in svg
    assert "nan" not in svg


def test_columns_share_the_width_and_names_are_escaped() -> None:
    svg = draw([Panel("a & <b>")] * 3, 0.0, 1.0, columns=2)
    assert box(svg, 0)[2] == box(svg, 1)[2] < box(svg, 2)[2]
    assert box(svg, 1)[0] > box(svg, 0)[0] + box(svg, 0)[1]
    assert svg.count("a &amp; &lt;b&gt;") == 3
