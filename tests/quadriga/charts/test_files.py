"""Figures in a page are small, safe to stand beside each other, and the same each time."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from PIL import Image

from quadriga.charts.colours import PALETTE
from quadriga.charts.draw import draw_panels
from quadriga.charts.files import save_png, to_svg
from quadriga.charts.panels import Curve, Panel, PanelGrid
from quadriga.report import document

TIME = np.linspace(0.0, 10.0, 1001)


def svg(name: str, across: str = "time [s]") -> str:
    curves = [Curve(TIME, np.sin(7 * TIME), "own"), Curve(TIME, np.cos(7 * TIME), "r6")]
    grid = PanelGrid(0.0, 10.0, across=across)
    return to_svg(draw_panels([Panel("y [m]", curves)], grid, legend=[("own", "mine")]), name)


def test_the_same_figure_is_the_same_to_the_byte() -> None:
    assert svg("a") == svg("a")
    assert "Date" not in svg("a")
    assert "matplotlib" not in svg("a").lower()


def test_two_figures_of_a_page_share_no_identifier() -> None:
    first, second = (set(re.findall(r' id="([^"]*)"', svg(name))) for name in ("a", "b"))
    assert first
    assert not first & second


def test_every_reference_leads_to_an_identifier() -> None:
    drawn = svg("a")
    used = set(re.findall(r'(?:xlink:href="#|url\(#)([^")]*)', drawn))
    assert used == set(re.findall(r' id="([^"]*)"', drawn))


def test_a_point_of_a_curve_takes_little_room() -> None:
    assert len(svg("a")) < 10 * 2 * len(TIME)


def test_all_colours_are_those_of_the_pages_style() -> None:
    drawn = svg("a")
    assert not re.search(r"#[0-9a-f]{6}[;\"]", drawn)
    style = (Path(document.__file__).parent / "style.css").read_text(encoding="utf-8")
    light, dark = style.split("@media (prefers-color-scheme: dark)")[:2]
    for name, colour in PALETTE.items():
        assert f"--{name}: {colour};" in light
        assert f"--{name}: #" in dark


def test_only_a_figure_over_time_follows_the_clock() -> None:
    assert 'class="time"' in svg("a")
    assert "data-panels=" in svg("a")
    assert 'class="other"' in svg("a", "robots")
    assert "data-panels=" not in svg("a", "robots")


def test_a_picture_has_something_on_it(tmp_path: Path) -> None:
    save_png(
        draw_panels([Panel("y", [Curve(TIME, TIME, "own")])], PanelGrid(0.0, 1.0)),
        tmp_path / "a.png",
    )
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.width > 1000
        assert len(np.unique(np.asarray(picture.convert("L")))) > 50


def test_a_curve_goes_through_its_points_to_a_tenth_of_a_point() -> None:
    values = np.sin(7 * TIME)
    figure = draw_panels([Panel("y", [Curve(TIME, values, "planned")])], PanelGrid(0.0, 10.0))
    (axes,) = figure.axes
    drawn = to_svg(figure, "a")
    (path,) = re.findall(r'd="M([^"]*)" clip-path="[^"]*" style="[^"]*--purple', drawn)
    (places,) = re.findall(r'data-panels="([^"]*)"', drawn)
    numbers = re.findall(r"-?\d*\.?\d+", path)
    corners = np.cumsum(np.array(numbers, dtype=float).reshape(-1, 2), axis=0)
    left, width, top, height = map(float, places.split()[:4])
    low, high = axes.get_ylim()
    x = left + width * TIME / 10.0
    y = top + height * (high - values) / (high - low)
    np.testing.assert_allclose(
        np.interp(x, *corners.T), y, atol=0.5
    )  # what is almost straight is drawn straight
