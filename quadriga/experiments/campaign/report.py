"""What came of a campaign, from its folder alone, and the same as tables in Markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from quadriga.experiments.campaign.ledger import read_manifest, read_rows
from quadriga.experiments.campaign.manifest import Manifest
from quadriga.experiments.plan import Group
from quadriga.experiments.results import COST, Results
from quadriga.experiments.seeds import format_seeds
from quadriga.experiments.summarise import build_lines
from quadriga.experiments.sweep import order_values
from quadriga.experiments.tables import (
    POOLED_NOTE,
    build_falls_table,
    build_ratios_table,
    build_walks_table,
)
from quadriga.experiments.trial.outcome import TrialOutcome
from quadriga.recordings.traces import ERRORS
from quadriga.shared.errors import ConfigError
from quadriga.tables import Table

_WALKS: Final = (
    "trials", "success", "falls", "stops", "time-to-fall", "vx", "transport", "p50", "p99",
    "radius", "plans",
)  # fmt: skip
_NOTES: Final = {
    "success": "Success: every robot walked to the end; in brackets Wilson's 95 % interval. "
    "Medians: time to fall over the falls; mean vx and cost of transport (∑|τ·q̇|dt / (m g d), "
    "payload included) over the walks to the end; plan times over the trials' own quantiles, "
    "without the first plan of each process, on a loaded machine. Radius: of the iteration of the "
    "robots' plans, which converges below 1.",
    "falls": "Pairs: the same world and seed with the baseline. Difference of the fall rates, "
    "negative where the variant falls less, with Newcombe's 95 % interval for paired proportions; "
    "p of McNemar's exact two-sided test, each of a single test, not corrected for their number.",
    "errors": "Pairs that both walked to the end: RMSE, and control cost, over that of the "
    "baseline. Median, in brackets its exact 95 % interval (order statistics; six pairs at least).",
    "tracking": "Root mean square errors over the steady part, all robots; medians over the walks "
    "to the end. z: over the terrain under the hips, or over the stance feet as measured.",
}


@dataclass(frozen=True, slots=True)
class CampaignReport:
    """Everything that a folder holds.

    Attributes:
        folder: where, as it was given.
        rows: of each group that has any.
        results: what they came to.
        worst: trials of each group that are named as the worst.
    """

    folder: Path
    manifest: Manifest
    rows: Mapping[Group, Sequence[TrialOutcome]]
    results: Results
    worst: int

    @property
    def title(self) -> str:
        """A headline."""
        return f"Campaign: {', '.join(dict.fromkeys(e.scenario for e in self.manifest.groups))}"

    @property
    def lead(self) -> str:
        """How much was walked, in a sentence."""
        results, worlds = self.results, len(self.results.worlds)
        done = sum(map(len, self.rows.values()))
        text = (
            f"{done:,} walks: {len(results.variants)} variants, {worlds} "
            f"{'world' if worlds == 1 else 'worlds'}, {len(results.seeds)} seeds "
            f"({format_seeds(results.seeds)}), paired"
        )
        left = self.manifest.trials - done
        return text + (f"; {left:,} are still to be walked" if left > 0 else "")

    def build_table(self, section: str) -> Table | None:
        """A table with what it means below it: `success`, `falls`, `errors` or `tracking`."""
        results = self.results
        if section == "success":
            table = build_walks_table(results, _WALKS)
        elif section == "falls":
            table = build_falls_table(results)
        elif section == "errors":
            table = build_ratios_table(results, (COST, *ERRORS))
        else:
            names = [f"rmse-{name}" for name in ERRORS]
            table = build_walks_table(results, names, "Tracking errors")
        paired = section in ("falls", "errors") and len(results.worlds) > 1
        notes = (*table.notes, _NOTES[section], *([POOLED_NOTE] if paired else []))
        return replace(table, notes=notes) if table.rows else None

    def to_markdown(self) -> str:
        """All tables, and the commands that walked."""
        tables = [self.build_table(section) for section in _NOTES]
        typed = "\n".join(self.manifest.typed)
        foot = f"Walked by\n\n```sh\n{typed}\n```\n\nwith {self.manifest.versions}.\n"
        shown = [table.to_markdown() for table in tables if table is not None]
        return "\n".join([f"# {self.title}\n", f"{self.lead}\n", *shown, foot])


def read_report(folder: Path, baseline: str | None, worst: int) -> CampaignReport:
    """What a campaign's folder holds.

    Args:
        folder: of the campaign.
        baseline: another variant to compare with than the campaign's own.
        worst: trials of each group that are named as the worst.

    Raises:
        ConfigError: the folder is no campaign's, or holds no row; an unknown baseline.
    """
    manifest = read_manifest(folder)
    rows = read_rows(folder, manifest)
    base = baseline or manifest.baseline
    if base not in manifest.variants:
        raise ConfigError("--baseline", repr(base), f"one of {', '.join(manifest.variants)}")
    if not rows:
        raise ConfigError(str(folder), "no trial", "at least one that was walked")
    wanted = _order_groups(manifest)
    worlds = tuple(dict.fromkeys(group.world for group in wanted))
    results = Results(
        baseline=base,
        variants=tuple(manifest.variants),
        worlds=worlds,
        swept=tuple(sweep.name for sweep in manifest.sweeps),
        lines=build_lines(
            rows,
            wanted,
            base,
            pooled=len(worlds) > 1,
            radii={e.group: e.radius for e in manifest.groups if e.radius is not None},
        ),
        seeds=tuple(sorted({seed for entry in manifest.groups for seed in entry.seeds})),
        versions=(manifest.versions,),
    )
    by_group = {group: [row for row in rows if row.group == group] for group in wanted}
    rows_by_group = {group: mine for group, mine in by_group.items() if mine}
    return CampaignReport(folder, manifest, rows_by_group, results, worst)


def _order_groups(manifest: Manifest) -> dict[Group, int]:
    """Trials of each group: scenarios as typed, swept values by size, variants within them."""
    scenarios = list(dict.fromkeys(entry.scenario for entry in manifest.groups))
    variants = list(manifest.variants)
    ordered = sorted(
        manifest.groups,
        key=lambda entry: (
            scenarios.index(entry.scenario),
            order_values(entry.swept),
            variants.index(entry.variant),
        ),
    )
    return {entry.group: len(entry.seeds) for entry in ordered}
