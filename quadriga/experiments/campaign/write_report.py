"""SHELL of a campaign's report: one page, and the same tables as Markdown."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from rich.console import Console

from quadriga.experiments.campaign.ledger import explain_write_errors
from quadriga.experiments.campaign.page import build_page
from quadriga.experiments.campaign.recordings import record_trials
from quadriga.experiments.campaign.report import CampaignReport, read_report
from quadriga.experiments.summarise import find_worst
from quadriga.shared.runtime.atomic import write_text

PAGE: Final = "report.html"
TABLES: Final = "report.md"
_WORST: Final = 3  # trials of each group that are named


def write_report(
    folder: Path, *, baseline: str | None = None, record_worst: int = 0, console: Console
) -> CampaignReport:
    """Write the page and the tables of a campaign.

    Args:
        folder: of the campaign.
        baseline: another variant to compare with than the campaign's own.
        record_worst: record so many of the worst trials of each group first.
        console: for progress.

    Raises:
        ConfigError: the folder is no campaign's, holds no row, or cannot be written to; an unknown
            baseline.
        ProcessError: a trial could not be recorded.
    """
    report = read_report(folder, baseline, max(record_worst, _WORST))
    if record_worst:
        wanted = [row for rows in report.rows.values() for row in find_worst(rows, record_worst)]
        record_trials(folder, report.manifest, wanted, console)
    with explain_write_errors(folder):
        write_text(folder / PAGE, build_page(report))
        write_text(folder / TABLES, report.to_markdown())
    return report
