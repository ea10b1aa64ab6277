"""The report of a campaign from its folder alone: one page, and the same tables as Markdown."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rich.console import Console

from quadriga.experiments.campaign import charts, sheets
from quadriga.experiments.campaign.again import command, record, recorded
from quadriga.experiments.campaign.analysis import against, by_group, worst
from quadriga.experiments.campaign.ledger import kept_in, read_manifest, read_rows, write_text
from quadriga.experiments.campaign.manifest import Manifest
from quadriga.experiments.campaign.outcome import TrialOutcome
from quadriga.experiments.campaign.run import config_file
from quadriga.experiments.campaign.sheets import Rows
from quadriga.report.document import (
    Cell,
    Document,
    Fold,
    PageTable,
    Paragraph,
    Part,
    Section,
    Subtitle,
    Text,
)
from quadriga.shared.errors import ConfigError
from quadriga.tables import Table, print_tables

PAGE: Final = "report.html"
TABLES: Final = "report.md"
_WORST: Final = 3  # trials of each group that are named


@dataclass(frozen=True, slots=True)
class Campaign:
    """Everything that a folder holds.

    Attributes:
        folder: where, as it was given.
        baseline: the variant that others are compared with.
        named: trials of each group that are named as the worst.
    """

    folder: Path
    manifest: Manifest
    rows: Rows
    baseline: str
    named: int


def report(
    folder: Path, *, baseline: str | None, record_worst: int, console: Console, shown: bool = True
) -> Path:
    """Write the page and the tables of a campaign; show success and falls.

    Args:
        folder: of the campaign.
        baseline: another variant to compare with than the campaign's own.
        record_worst: record so many of the worst trials of each group first.
        console: for progress; the tables go to stdout.
        shown: whether any go there.

    Returns:
        The page.

    Raises:
        ConfigError: the folder is no campaign's, holds no row, or cannot be written to; an unknown
            baseline.
        ProcessError: a trial could not be recorded.
    """
    manifest = read_manifest(folder)
    rows = by_group(read_rows(folder, manifest))
    base = baseline or manifest.baseline
    if base not in manifest.variants:
        raise ConfigError("--baseline", repr(base), f"one of {', '.join(manifest.variants)}")
    if not rows:
        raise ConfigError(str(folder), "no trial", "at least one that was walked")
    campaign = Campaign(folder, manifest, rows, base, max(record_worst, _WORST))
    if record_worst:
        wanted = [row for found in rows.values() for row in worst(found, record_worst)]
        record(folder, manifest, wanted, console)
    first, rest = _tables(campaign)
    with kept_in(folder):
        write_text(folder / PAGE, _page(campaign))
        write_text(folder / TABLES, _markdown(campaign, [*first, *rest]))
    if shown:
        print_tables(first)
    return folder / PAGE


def _tables(campaign: Campaign) -> tuple[list[Table], list[Table]]:
    """Tables that are shown at once, and those that are for the files alone."""
    manifest, rows = campaign.manifest, campaign.rows
    falls = sheets.fall_sheets(manifest, rows, campaign.baseline)
    errors = sheets.ratio_sheets(manifest, rows, campaign.baseline)
    return [*sheets.outcome_sheets(manifest, rows), *falls], [
        *sheets.tracking_sheets(manifest, rows),
        *errors,
    ]


def _markdown(campaign: Campaign, tables: Sequence[Table]) -> str:
    head = [f"# {_title(campaign)}\n", f"{_lead(campaign)}\n"]
    typed = "\n".join(campaign.manifest.typed)
    foot = f"Walked by\n\n```sh\n{typed}\n```\n\nwith {campaign.manifest.versions}.\n"
    return "\n".join([*head, *(sheet.to_markdown() for sheet in tables), foot])


def _page(campaign: Campaign) -> str:
    return Document(_title(campaign), _lead(campaign), list(_sections(campaign))).to_html()


def _title(campaign: Campaign) -> str:
    scenarios = dict.fromkeys(entry.scenario for entry in campaign.manifest.groups)
    return f"Campaign: {', '.join(scenarios)}"


def _lead(campaign: Campaign) -> str:
    manifest = campaign.manifest
    done, seeds = (
        sum(map(len, campaign.rows.values())),
        {seed for entry in manifest.groups for seed in entry.seeds},
    )
    worlds = len({entry.group.world for entry in manifest.groups})
    text = (
        f"{done:,} walks: {len(manifest.variants)} variants, {worlds} "
        f"{'world' if worlds == 1 else 'worlds'}, {len(seeds)} seeds ({span(sorted(seeds))}), "
        "paired"
    )
    left = manifest.trials - done
    return text + (f"; {left:,} are still to be walked" if left > 0 else "")


def _sections(campaign: Campaign) -> Iterator[Section]:
    manifest, rows, base = campaign.manifest, campaign.rows, campaign.baseline
    drawn: list[Part] = []
    for name, drawing in charts.against_swept(manifest, rows):
        drawn += [Subtitle([f"Against {name}"]), drawing]
    if drawn:
        drawn.append(Paragraph(["Bars: Wilson's 95 % intervals."], soft=True))
    else:
        drawn = [charts.by_variant(manifest, rows)]
    tables = _shown(sheets.outcome_sheets(manifest, rows))
    yield Section("success", "Success", drawn + tables)
    if beside := sheets.fall_sheets(manifest, rows, base):
        yield Section("falls", f"Falls against {base}", _shown(beside))
        errors = sheets.ratio_sheets(manifest, rows, base)
        yield Section("errors", f"Errors against {base}", _shown(errors))
    yield Section("tracking", "Tracking", _shown(sheets.tracking_sheets(manifest, rows)))
    yield Section("worst", "Worst seeds", list(_worst(campaign)))
    yield Section("walked", "What was walked", [_walked(campaign)])


def _shown(found: Sequence[Table]) -> list[Part]:
    """Tables; notes that all of them share come once, at the end."""
    parts: list[Part] = []
    notes = {note: None for sheet in found for note in sheet.notes}
    for sheet in found:
        # Columns of text at the left stay so: swept values are numbers as they were typed.
        parts.append(Subtitle([sheet.title.partition(":")[0]]))
        parts.append(PageTable(sheet.columns, sheet.rows, named=True, numbers=True))
    return parts + [Paragraph([note], soft=True) for note in notes]


def _worst(campaign: Campaign) -> Iterator[Part]:
    base = [r for g, rows in campaign.rows.items() if g.variant == campaign.baseline for r in rows]
    yield Paragraph(
        [
            "The earliest falls of each group, then stops, then the greatest control cost. The "
            "command walks a trial again over the bus, which comes to the same, and records it; ",
            Cell("--record-worst K", code=True),
            " does so for the K worst of each group.",
        ]
    )
    for entry in campaign.manifest.groups:
        rows = campaign.rows.get(entry.group, ())
        lines = [_line(campaign, row) for row in worst(rows, campaign.named)]
        if not lines:
            continue
        beside = against(rows, base)
        parts: list[Part] = [
            Paragraph([f"{what}: seeds {span(seeds)}."])
            for what, seeds in (
                ("Fell where the baseline did not", beside.alone),
                ("Did not fall where the baseline did", beside.spared),
            )
            if seeds
        ]
        parts.append(PageTable(("seed", "what", "recording", "again"), lines, named=True))
        fell = any(row.fell for row in rows)
        yield Fold(" · ".join((*entry.group.world, entry.variant)), parts, opened=fell)


def _line(campaign: Campaign, row: TrialOutcome) -> list[Text]:
    page = recorded(campaign.folder, row)
    link = Cell("recording", page.as_posix()) if page else "–"
    again = "–" if page else Cell(command(campaign.folder, row), code=True)
    return [str(row.seed), _what(row), link, again]


def _what(row: TrialOutcome) -> str:
    if row.fell:
        return f"{row.first_to_fall} fell at {row.time_to_fall_s:.2f} s"
    if not row.success:
        return row.stopped
    return "walked" if row.control_cost is None else f"walked, control cost {row.control_cost:.0f}"


def _walked(campaign: Campaign) -> PageTable:
    manifest = campaign.manifest
    facts = [("baseline", campaign.baseline)]
    facts += [
        (f"variant {name}", ", ".join(f"{k} = {v}" for k, v in keys.items()) or "as configured")
        for name, keys in manifest.variants.items()
    ]
    for entry in manifest.groups:
        digest = entry.predictor_sha256[:12] or "none"
        facts.append(
            (
                " · ".join((*entry.group.world, entry.variant)),
                f"seeds {span(entry.seeds)}; predictor {digest}; "
                f"{config_file(Path('.'), entry.group)}",
            )
        )
    facts.append(("code and libraries", manifest.versions))
    facts.append(("commands", "\n".join(manifest.typed)))
    return PageTable((), facts, named=True)


def span(seeds: Sequence[int]) -> str:
    """`0 … 19, 23`."""
    parts: list[list[int]] = []
    for seed in sorted(set(seeds)):
        if parts and seed == parts[-1][-1] + 1:
            parts[-1].append(seed)
        else:
            parts.append([seed])
    return ", ".join(f"{p[0]} … {p[-1]}" if len(p) > 2 else ", ".join(map(str, p)) for p in parts)


def spanned(text: str) -> set[int]:
    """The seeds of which `span` made the text."""
    return {
        seed
        for first, last in re.findall(r"(\d+)(?: … (\d+))?", text)
        for seed in range(int(first), int(last or first) + 1)
    }
