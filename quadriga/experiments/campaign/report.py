"""The report of a campaign from its folder alone: one page, and the same tables as Markdown."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
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
from quadriga.report.html import details, document, table
from quadriga.shared.errors import ConfigError
from quadriga.sheet import Sheet, show

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
        show(first)
    return folder / PAGE


def _tables(campaign: Campaign) -> tuple[list[Sheet], list[Sheet]]:
    """Tables that are shown at once, and those that are for the files alone."""
    manifest, rows = campaign.manifest, campaign.rows
    falls = sheets.fall_sheets(manifest, rows, campaign.baseline)
    errors = sheets.ratio_sheets(manifest, rows, campaign.baseline)
    return [*sheets.outcome_sheets(manifest, rows), *falls], [
        *sheets.tracking_sheets(manifest, rows),
        *errors,
    ]


def _markdown(campaign: Campaign, tables: Sequence[Sheet]) -> str:
    head = [f"# {_title(campaign)}\n", f"{_lead(campaign)}\n"]
    typed = "\n".join(campaign.manifest.typed)
    foot = f"Walked by\n\n```sh\n{typed}\n```\n\nwith {campaign.manifest.versions}.\n"
    return "\n".join([*head, *(sheet.to_markdown() for sheet in tables), foot])


def _page(campaign: Campaign) -> str:
    return document(
        _title(campaign),
        f'<p class="verdict">{escape(_lead(campaign))}</p>',
        list(_sections(campaign)),
        "",
    )


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


def _sections(campaign: Campaign) -> Iterator[tuple[str, str, str]]:
    manifest, rows, base = campaign.manifest, campaign.rows, campaign.baseline
    swept = "".join(
        f"<h3>Against {escape(name)}</h3>{drawn}"
        for name, drawn in charts.against_swept(manifest, rows)
    )
    tables = _shown(sheets.outcome_sheets(manifest, rows))
    yield "success", "Success", (swept or charts.by_variant(manifest, rows)) + tables
    if beside := sheets.fall_sheets(manifest, rows, base):
        yield "falls", f"Falls against {base}", _shown(beside)
        errors = sheets.ratio_sheets(manifest, rows, base)
        yield "errors", f"Errors against {base}", _shown(errors)
    yield "tracking", "Tracking", _shown(sheets.tracking_sheets(manifest, rows))
    yield "worst", "Worst seeds", _worst(campaign)
    yield "walked", "What was walked", _walked(campaign)


def _shown(found: Sequence[Sheet]) -> str:
    """Tables; notes that all of them share come once, at the end."""
    parts, notes = [], {note: None for sheet in found for note in sheet.notes}
    for sheet in found:
        # Columns of text at the left stay so: swept values are numbers as they were typed.
        parts.append(f"<h3>{escape(sheet.title.partition(':')[0])}</h3>")
        parts.append(table(sheet.columns, sheet.rows, named=True, numbers=True))
    return "".join(parts) + "".join(f'<p class="soft">{escape(note)}</p>' for note in notes)


def _worst(campaign: Campaign) -> str:
    base = [r for g, rows in campaign.rows.items() if g.variant == campaign.baseline for r in rows]
    parts = [
        "<p>The earliest falls of each group, then stops, then the greatest control cost. The "
        "command walks a trial again over the bus, which comes to the same, and records it; "
        "<code>--record-worst K</code> does so for the K worst of each group.</p>"
    ]
    for entry in campaign.manifest.groups:
        rows = campaign.rows.get(entry.group, ())
        lines = [_line(campaign, row) for row in worst(rows, campaign.named)]
        if not lines:
            continue
        beside = against(rows, base)
        said = "".join(
            f"<p>{what}: seeds {span(seeds)}.</p>"
            for what, seeds in (
                ("Fell where the baseline did not", beside.alone),
                ("Did not fall where the baseline did", beside.spared),
            )
            if seeds
        )
        content = said + table(("seed", "what", "recording", "again"), lines, named=True, raw=True)
        fell = any(row.fell for row in rows)
        parts.append(details(" · ".join((*entry.group.world, entry.variant)), content, opened=fell))
    return "".join(parts)


def _line(campaign: Campaign, row: TrialOutcome) -> tuple[str, ...]:
    page = recorded(campaign.folder, row)
    link = f'<a href="{escape(page.as_posix())}">recording</a>' if page else "–"
    again = "–" if page else f"<code>{escape(command(campaign.folder, row))}</code>"
    return str(row.seed), escape(_what(row)), link, again


def _what(row: TrialOutcome) -> str:
    if row.fell:
        return f"{row.first_to_fall} fell at {row.time_to_fall_s:.2f} s"
    if not row.success:
        return row.stopped
    return "walked" if row.control_cost is None else f"walked, control cost {row.control_cost:.0f}"


def _walked(campaign: Campaign) -> str:
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
    return table((), facts, named=True)


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
