"""Figures as files, and as SVG for pages: small, and in the colours of the page's style."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from quadriga.charts.colours import PALETTE
from quadriga.charts.draw import POINTS_PER_INCH, TEXT
from quadriga.charts.panels import TIME
from quadriga.shared.errors import ConfigError

_DPI: Final = 110
_SVG: Final = "{http://www.w3.org/2000/svg}"
_VARIABLES: Final = {colour: f"var(--{name})" for name, colour in PALETTE.items()}
_NO_METADATA: Final = dict.fromkeys(("Date", "Creator", "Format", "Type"))
# By the ending of a file what would differ from day to day, or with what drew it.
_LEFT_OUT: Final[Mapping[str, tuple[str, ...]]] = {
    ".png": ("Software",),
    ".pdf": ("CreationDate", "Creator", "Producer"),
    ".svg": ("Date", "Creator"),
}
_POINT: Final = re.compile(r"-?\d+\.\d+")
_CURVED: Final = re.compile("[QC]")
_LETTER: Final = re.compile("[Lz]")
_DROPPED: Final = re.compile(
    rf"(font-size:{TEXT:g}px|(font-family|stroke-linecap|stroke-linejoin):[^;]*);?"
)


def save_png(figure: Figure, path: Path) -> None:
    """Write a figure.

    Raises:
        OSError: the file cannot be written.
    """
    FigureCanvasAgg(figure)
    figure.savefig(path, dpi=_DPI)


def check_ending(path: Path, name: str) -> None:
    """Refuse a file that is neither PNG, nor PDF, nor SVG by its ending.

    Args:
        path: the file.
        name: what asked for it, for the error.

    Raises:
        ConfigError: it has another ending.
    """
    if path.suffix.lower() not in _LEFT_OUT:
        raise ConfigError(name, str(path), "a file that ends in .png, .pdf or .svg")


def save_figure(figure: Figure, path: Path, ending: str) -> None:
    """Write a figure as PNG, PDF or SVG, as `ending` says; equal ones are equal to the byte.

    Raises:
        OSError: the file cannot be written.
    """
    ending = ending.lower()
    FigureCanvasAgg(figure)
    # Equal names within an SVG each time; fonts in a PDF as publishers take them.
    with mpl.rc_context({"svg.hashsalt": "quadriga", "pdf.fonttype": 42}):
        form, metadata = ending.removeprefix("."), dict.fromkeys(_LEFT_OUT[ending])
        figure.savefig(path, format=form, dpi=_DPI, metadata=metadata)


def to_svg(figure: Figure, name: str) -> str:
    """A figure as SVG to stand in a page; equal figures of one name are equal to the byte.

    Colours of the palette become variables of the page's style sheet. A figure over world time
    carries, for the page's script, each panel's left side, width, upper side and height in points,
    and its first and last time in s.

    Args:
        figure: the figure.
        name: what it shows, for those who do not see it; unique within a page.
    """
    file = io.StringIO()
    figure.patch.set_visible(False)
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": name}):
        FigureCanvasSVG(figure)
        figure.savefig(file, format="svg", metadata=_NO_METADATA)
    root = ElementTree.fromstring(file.getvalue())
    _compact(root)
    over_time = any(axes.get_xlabel() == TIME for axes in figure.axes)
    width, height = (POINTS_PER_INCH * side for side in figure.get_size_inches())
    root.attrib = {
        "class": "time" if over_time else "other",
        "viewBox": f"0 0 {width:.0f} {height:.0f}",
        "role": "img",
        "aria-label": name,
    }
    if over_time:
        root.set("data-panels", ",".join(_places(figure, width, height)))
    ElementTree.register_namespace("", _SVG.strip("{}"))
    ElementTree.register_namespace("xlink", "http://www.w3.org/1999/xlink")
    return ElementTree.tostring(root, encoding="unicode")


def _places(figure: Figure, width: float, height: float) -> list[str]:
    places = []
    for axes in figure.axes:
        box, (begin, end) = axes.get_position(), axes.get_xlim()
        sides = (width * box.x0, width * box.width, height * (1 - box.y1), height * box.height)
        places.append(" ".join([*(f"{side:.0f}" for side in sides), f"{begin:.4f} {end:.4f}"]))
    return places


def _compact(element: ElementTree.Element) -> None:
    """Round to tenths of a point, drop what the page's style says, unwrap bare groups."""
    children: list[ElementTree.Element] = []
    for child in element:
        _compact(child)
        bare = child.tag == f"{_SVG}g" and set(child.attrib) <= {"id"}
        if bare or (child.tag == f"{_SVG}defs" and not len(child)):
            children.extend(child)
        elif child.tag not in (f"{_SVG}style", f"{_SVG}metadata"):
            children.append(child)
    element[:] = children
    element.tail = None
    if element.tag != f"{_SVG}text":
        element.text = None
    for key in ("x", "y", "width", "height", "transform"):
        if key in element.attrib:
            element.set(key, _round(element.attrib[key]))
    if "d" in element.attrib:
        element.set("d", _shorten(element.attrib["d"]))
    if element.get("transform", "").startswith("rotate(-0 "):
        del element.attrib["transform"]
    if "style" in element.attrib:
        style = _DROPPED.sub("", element.attrib["style"].replace(": ", ":").replace("; ", ";"))
        for colour, variable in _VARIABLES.items():
            style = style.replace(colour, variable)
        element.set("style", style.strip("; "))


def _round(numbers: str) -> str:
    """All numbers of a text in tenths."""
    return _POINT.sub(lambda match: f"{float(match[0]):.1f}".removesuffix(".0"), numbers)


def _shorten(path: str) -> str:
    """A path in tenths; of lines each corner as the step from the one before."""
    if _CURVED.search(path):
        return _round(path)
    parts = []
    for line in path.split("M")[1:]:
        end = "z" if line.rstrip().endswith("z") else ""
        corners = np.array(_LETTER.sub(" ", line).split(), dtype=float).reshape(-1, 2)
        tenths = np.rint(10.0 * corners).astype(np.int64)
        steps = np.diff(tenths, axis=0)
        steps = steps[steps.any(axis=1)]
        words = [_join_tenths(*pair) for pair in steps.tolist()]
        parts.append(f"M{_join_tenths(*tenths[0].tolist())}l{' '.join(words) or '0 0'}{end}")
    return "".join(parts)


def _join_tenths(x: int, y: int) -> str:
    """Two numbers, given in tenths, as short as a path allows."""
    first, second = (f"{abs(value) / 10:g}".lstrip("0") or "0" for value in (x, y))
    return f"{'-' if x < 0 else ''}{first}{'-' if y < 0 else ' '}{second}"
