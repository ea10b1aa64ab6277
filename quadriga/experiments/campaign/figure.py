"""The figures of a campaign: success, falls and errors, on its page and in a file of one's own."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from quadriga.charts.files import check_ending, save_figure
from quadriga.experiments.campaign.ledger import explain_write_errors
from quadriga.experiments.campaign.report import CampaignReport
from quadriga.experiments.figures import (
    FigurePart,
    SweepPanel,
    build_falls,
    build_ratios,
    build_success,
    build_sweeps,
    draw_together,
)
from quadriga.experiments.results import COST, World
from quadriga.experiments.sweep import order_values, to_number
from quadriga.recordings.traces import ERRORS
from quadriga.shared.errors import ConfigError, name_file_errors
from quadriga.shared.runtime.atomic import atomic_write

OPTION: Final = "--figure"


def check_figure_file(path: Path) -> None:
    """Refuse a file that no figure can be written to, before hours of walking.

    Raises:
        ConfigError: another ending than that of PNG, PDF or SVG, or a folder that cannot be made.
    """
    check_ending(path, OPTION)
    with name_file_errors(ConfigError, f"{OPTION} {path}", "a file in a folder that can be made"):
        path.parent.mkdir(parents=True, exist_ok=True)


def write_figure(report: CampaignReport, path: Path) -> None:
    """Write success, falls and errors of a campaign as one figure.

    Raises:
        ConfigError: no trial was walked, or the file cannot be written.
    """
    parts = [part for drawn in build_parts(report).values() for _, part in drawn]
    if not parts:
        raise ConfigError(OPTION, "no trial that was walked", "something to draw")
    with explain_write_errors(path.parent), atomic_write(path) as partial:
        save_figure(draw_together(parts), partial, path.suffix)


def build_parts(report: CampaignReport) -> dict[str, list[tuple[str, FigurePart]]]:
    """What there is to draw of each section of the page, each with what it shows."""
    results, base = report.results, report.results.baseline
    ratios = build_ratios(results, (COST, *ERRORS))
    return {
        "success": list(_build_success(report)),
        "falls": _list_part(build_falls(results), f"falls against {base}"),
        "errors": _list_part(ratios, f"errors against {base}"),
    }


def _list_part(part: FigurePart | None, name: str) -> list[tuple[str, FigurePart]]:
    return [] if part is None else [(name, part)]


def _build_success(report: CampaignReport) -> Iterator[tuple[str, FigurePart]]:
    """Success against each swept key that has numbers; else of each variant in each world."""
    swept = False
    for k, sweep in enumerate(report.manifest.sweeps):
        panels = _build_panels(report.results.worlds, k, sweep.name)
        for named in _list_part(
            build_sweeps(report.results, panels), f"success against {sweep.name}"
        ):
            swept = True
            yield named
    if not swept:
        yield from _list_part(build_success(report.results), "success by variant")


def _build_panels(worlds: Sequence[World], k: int, axis: str) -> list[SweepPanel]:
    """A panel for each scenario and each value of the other keys than the k-th."""
    values = {world[1 + k] for world in worlds}
    if len(values) < 2 or any(math.isinf(to_number(value)) for value in values):
        return []
    points: dict[World, list[tuple[str, World]]] = {}
    for world in worlds:
        others = (*world[: 1 + k], *world[2 + k :])
        points.setdefault(others, []).append((world[1 + k], world))
    return [
        SweepPanel(" · ".join(rest), axis, sorted(same, key=lambda point: order_values(point[:1])))
        for rest, same in points.items()
    ]
