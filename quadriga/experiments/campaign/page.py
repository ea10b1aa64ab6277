"""The page of a campaign: its tables and figures, its worst trials, and what was walked."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from quadriga.experiments.campaign.configs import config_file
from quadriga.experiments.campaign.figure import build_parts
from quadriga.experiments.campaign.recordings import build_command, find_recording
from quadriga.experiments.campaign.report import CampaignReport
from quadriga.experiments.plan import Group
from quadriga.experiments.results import Line
from quadriga.experiments.seeds import format_seeds
from quadriga.experiments.summarise import find_worst
from quadriga.experiments.trial.outcome import TrialOutcome
from quadriga.report.document import (
    Cell,
    Document,
    Drawing,
    Fold,
    PageTable,
    Paragraph,
    Part,
    Section,
    Text,
)


def build_page(report: CampaignReport) -> str:
    """The page as HTML."""
    return Document(report.title, report.lead, list(_build_sections(report))).to_html()


def _build_sections(report: CampaignReport) -> Iterator[Section]:
    base, figures = report.results.baseline, build_parts(report)
    titles = {
        "success": "Success",
        "falls": f"Falls against {base}",
        "errors": f"Errors against {base}",
        "tracking": "Tracking",
    }
    for anchor, title in titles.items():
        table = report.build_table(anchor)
        if table is not None:
            # Columns of text at the left stay so: swept values are numbers as they were typed.
            shown = PageTable(table.columns, table.rows, named=True, numbers=True)
            notes = [Paragraph([note], soft=True) for note in table.notes]
            drawn = [Drawing(part.draw(), name) for name, part in figures.get(anchor, [])]
            yield Section(anchor, title, [*drawn, shown, *notes])
    yield Section("worst", "Worst seeds", list(_build_worst(report)))
    yield Section("walked", "What was walked", [_build_facts(report)])


def _build_worst(report: CampaignReport) -> Iterator[Part]:
    yield Paragraph(
        [
            "The earliest falls of each group, then stops, then the greatest control cost. The "
            "command walks a trial again over the bus, which comes to the same, and records it; ",
            Cell("--record-worst K", code=True),
            " does so for the K worst of each group.",
        ]
    )
    for group, rows in report.rows.items():
        lines = [_build_row(report.folder, row) for row in find_worst(rows, report.worst)]
        if lines:
            parts = _build_seeds(report.results.find(group.world, group.variant))
            parts.append(PageTable(("seed", "what", "recording", "again"), lines, named=True))
            yield Fold(_name_group(group), parts, opened=any(row.fell for row in rows))


def _build_seeds(line: Line | None) -> list[Part]:
    """Seeds in which either the variant or the baseline fell."""
    beside = None if line is None else line.beside
    if beside is None:
        return []
    return [
        Paragraph([f"{what}: seeds {format_seeds(seeds)}."])
        for what, seeds in (
            ("Fell where the baseline did not", beside.fell_alone),
            ("Did not fall where the baseline did", beside.baseline_fell_alone),
        )
        if seeds
    ]


def _build_row(folder: Path, row: TrialOutcome) -> list[Text]:
    page = find_recording(folder, row)
    link = Cell("recording", page.as_posix()) if page else "–"
    again = "–" if page else Cell(build_command(folder, row), code=True)
    return [str(row.seed), _format_outcome(row), link, again]


def _format_outcome(row: TrialOutcome) -> str:
    if row.fell:
        return f"{row.first_to_fall} fell at {row.time_to_fall_s:.2f} s"
    if not row.success:
        return row.stopped
    return "walked" if row.control_cost is None else f"walked, control cost {row.control_cost:.0f}"


def _build_facts(report: CampaignReport) -> PageTable:
    manifest = report.manifest
    facts = [("baseline", report.results.baseline)]
    facts += [
        (f"variant {name}", ", ".join(f"{k} = {v}" for k, v in keys.items()) or "as configured")
        for name, keys in manifest.variants.items()
    ]
    for entry in manifest.groups:
        digest = entry.predictor_sha256[:12] or "none"
        plugin = f"planner or controller {entry.plugin}; " if entry.plugin else ""
        text = f"seeds {format_seeds(entry.seeds)}; predictor {digest}; {plugin}"
        facts.append((_name_group(entry.group), f"{text}{config_file(Path(), entry.group)}"))
    facts.append(("code and libraries", manifest.versions))
    facts.append(("commands", "\n".join(manifest.typed)))
    return PageTable((), facts, named=True)


def _name_group(group: Group) -> str:
    return " · ".join((*group.world, group.variant))
