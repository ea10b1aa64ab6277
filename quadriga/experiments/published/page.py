"""The page of all experiments: text made of results."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from quadriga.experiments.campaign.progress import format_duration
from quadriga.experiments.measures import keep_together
from quadriga.experiments.published.experiment import Experiment
from quadriga.experiments.published.requirement_table import (
    build_requirement_table,
    format_finding,
    format_requirement,
    format_word,
)
from quadriga.experiments.published.summarise_experiment import count_trials
from quadriga.experiments.published.verdicts import RequirementVerdict, judge_requirements
from quadriga.experiments.results import POOLED, Results
from quadriga.experiments.seeds import format_seeds
from quadriga.experiments.tables import (
    POOLED_NOTE,
    build_falls_table,
    build_ratios_table,
    build_walks_table,
)
from quadriga.tables import NOTHING, Table

_MADE: Final = (
    "<!-- Generated, all of it, by `make figures` from deploy/experiments: do not edit. -->"
)
_READ: Final = """\
Every walk is of the whole system in lock-step, without a bus, which comes to the same to the byte
([campaigns.md](campaigns.md) says what is compared and how). Variants of an experiment walk in the
same worlds, seed by seed. A walk is a success if every robot walked to the end.

In brackets: 95 % intervals. Success rates: Wilson. Differences of fall rates, of pairs: Newcombe's
method 10, with the p of McNemar's exact two-sided test. Ratios: medians over the pairs that both
walked to the end, with the exact interval by order statistics. Each p and interval is that of a
single figure, not corrected for their number. Cost of transport, control cost and times of planning
are medians over walks; times are of the machine that walked, under load. Errors are by the ground
truth: z is the height over the terrain under the hips, and jumps where a hip passes the edge of a
block; z over the stance feet is as the robots measure it (a test holds it against the truth), and
what they are asked to keep. A requirement is held
against the figure itself unless it names a bound of its interval; behind *met* and *missed* stands
how far the figure, or that bound, is from the limit. What an experiment was walked with is named by
versions and by a digest of what the code does; code that does something else may come to other
figures.
"""
_OUTDATED: Final = (
    "**earlier defaults**: keys that this experiment does not set had other values when it was "
    "walked; the command walks with those of today"
)


@dataclass(frozen=True, slots=True)
class PageEntry:
    """An experiment and what came of it.

    Attributes:
        experiment: what was asked.
        results: what was found.
        figures: those there are, as paths from the page.
        outdated: whether it was walked with other defaults or scenarios than it has today.
    """

    experiment: Experiment
    results: Results
    figures: Sequence[str] = ()
    outdated: bool = False


def build_page(entries: Sequence[PageEntry]) -> str:
    """`docs/results.md`."""
    parts = [_MADE, "# Results", f"{_READ}\n{POOLED_NOTE}", build_overview(entries)]
    for entry in entries:
        parts += _section(entry)
    return "\n\n".join(parts) + "\n"


def build_overview(entries: Sequence[PageEntry]) -> str:
    """A row for each requirement: what was found, where it stands worst, and whether it is met."""
    rows = []
    for entry in entries:
        experiment = entry.experiment
        have, of = count_trials(experiment, entry.results)
        head = (f"[{experiment.name}](#{experiment.name})", _count(have, of))
        verdicts = judge_requirements(experiment, entry.results)
        for k, verdict in enumerate(verdicts):
            rows.append(
                (
                    *(head if not k else ("", "")),
                    format_requirement(verdict, experiment),
                    _format_findings(verdict),
                    format_word(verdict),
                )
            )
        if not verdicts:
            rows.append((*head, "nothing: a comparison", NOTHING, NOTHING))
    columns = ("experiment", "trials", "required", "found, and where it stands worst", "verdict")
    return format_table(Table("", columns, tuple(rows)), left=len(columns))


def format_table(table: Table, left: int = 1) -> str:
    """A table without its title; so many columns at the left are text."""
    head, _, *body = table.to_markdown().partition("\n\n")[2].strip().split("\n")
    rule = [":--"] * left + ["--:"] * (len(table.columns) - left)
    return "\n".join([head, f"| {' | '.join(rule)} |", *body])


def build_tables(experiment: Experiment, results: Results) -> list[Table]:
    """Every table that is published of an experiment and that has a row."""
    published, tables = experiment.published, [build_requirement_table(experiment, results)]
    if published.outcome:
        tables.append(build_walks_table(results, published.outcome))
    if published.falls:
        tables.append(build_falls_table(results))
    if published.ratios:
        tables.append(build_ratios_table(results, published.ratios))
    return [table for table in tables if table.rows]


def _section(entry: PageEntry) -> Iterator[str]:
    experiment, results = entry.experiment, entry.results
    yield f'<a id="{experiment.name}"></a>\n\n## {experiment.title}'
    yield experiment.question
    yield _facts(entry)
    yield _variants(experiment)
    if not results.lines:
        return
    for figure in entry.figures:
        yield f"![{experiment.title}]({figure})"
    for table in build_tables(experiment, results):
        left = table.columns.index("variant") + 1 if "variant" in table.columns else 2
        notes = "".join(f"\n\n{note}" for note in table.notes)
        yield f"### {table.title}\n\n{format_table(replace(table, notes=()), left)}{notes}"


def _facts(entry: PageEntry) -> str:
    experiment, results = entry.experiment, entry.results
    have, of = count_trials(experiment, results)
    walked = format_seeds(results.seeds) or "none"
    lines = [
        f"- command: `quadriga experiments {experiment.name}`",
        f"- seeds: {format_seeds(experiment.seeds)}; walked: {walked}",
        f"- trials: **{_count(have, of)}**"
        + (f", {format_duration(results.wall_s)} on one core" if have else ""),
        f"- baseline: {experiment.baseline}",
    ]
    lines += [f"- code and libraries: {versions}" for versions in results.versions]
    if entry.outdated:
        lines.append(f"- {_OUTDATED}")
    return "\n".join(lines)


def _variants(experiment: Experiment) -> str:
    rows = tuple(
        (
            variant.name,
            ", ".join(f"`{_key(key, value)}`" for key, value in variant.keys.items())
            or "the defaults",
        )
        for variant in experiment.variants
    )
    text = format_table(Table("", ("variant", "keys"), rows), left=2)
    for part in experiment.parts:
        if part.sweep is not None:
            labels = ", ".join(label for label, _ in part.sweep.values)
            text += f"\n\nSwept on {part.folder}: `{part.sweep.name}`, {part.axis}: {labels}."
    return text


def _key(key: str, value: Any) -> str:
    shown = str(value).lower() if isinstance(value, bool) else str(value)
    return f"{key} = {shown}"


def _count(have: int, of: int) -> str:
    return keep_together(f"{have:,} of {of:,}")


def _format_findings(verdict: RequirementVerdict) -> str:
    """What was found in all worlds together, if that is asked, and where it stands worst."""
    worst = verdict.worst
    if worst is None:
        return NOTHING
    if len(verdict.findings) == 1:
        return format_finding(verdict, worst)
    pooled = [one for one in verdict.findings if one.world == POOLED and one.margin is not None]
    shown = dict.fromkeys((*pooled, worst))
    return "; ".join(f"{' · '.join(one.world)}: {format_finding(verdict, one)}" for one in shown)
