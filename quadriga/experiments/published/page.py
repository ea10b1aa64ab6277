"""The page of all experiments, and the table that the README shows: text made of results."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from quadriga.experiments.campaign.bar import duration
from quadriga.experiments.campaign.report import span
from quadriga.experiments.campaign.sheets import POOLED_NOTE, unbroken
from quadriga.experiments.published.experiment import Experiment
from quadriga.experiments.published.results import Results
from quadriga.experiments.published.sheets import asked, finding_text, sheets, word_text
from quadriga.experiments.published.summarise import POOLED, done
from quadriga.experiments.published.verdict import RequirementVerdict, verdicts
from quadriga.tables import NOTHING, Table

BEGIN: Final = "<!-- results:begin -->"
END: Final = "<!-- results:end -->"
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
are medians over walks; times are of the machine that walked, under load. Errors are by the world's
truth: z is the height over the terrain under the hips, and jumps where a hip passes the edge of a
block; z-felt is that over the ground which the standing feet feel, by the robots' own word (a test
holds it against the truth), and what they are asked to keep. A requirement is held
against the figure itself unless it names a bound of its interval; behind *met* and *missed* stands
how far the figure, or that bound, is from the limit. What an experiment was walked with is named by
versions and by a digest of the code; walked with later code it may come to other figures.
"""


@dataclass(frozen=True, slots=True)
class PageEntry:
    """An experiment, what came of it, and the figures there are, as paths from the page."""

    experiment: Experiment
    results: Results
    figures: Sequence[str] = ()


def page(entries: Sequence[PageEntry]) -> str:
    """`docs/results.md`."""
    parts = [_MADE, "# Results", f"{_READ}\n{POOLED_NOTE}", overview(entries, "#")]
    for entry in entries:
        parts += _section(entry)
    return "\n\n".join(parts) + "\n"


def overview(entries: Sequence[PageEntry], link: str) -> str:
    """A row for each requirement: what was found, where it stands worst, and whether it is met.

    Args:
        entries: experiments, in order.
        link: what stands before the anchor of a section.
    """
    rows = []
    for entry in entries:
        experiment = entry.experiment
        have, of = done(experiment, entry.results)
        head = (f"[{experiment.name}]({link}{experiment.name})", _count(have, of))
        found = verdicts(experiment, entry.results)
        for k, verdict in enumerate(found):
            rows.append(
                (
                    *(head if not k else ("", "")),
                    asked(verdict, experiment),
                    _found(verdict),
                    word_text(verdict),
                )
            )
        if not found:
            rows.append((*head, "nothing: a comparison", NOTHING, NOTHING))
    columns = ("experiment", "trials", "required", "found, and where it stands worst", "verdict")
    return table(Table("", columns, tuple(rows)), left=len(columns))


def fragment(entries: Sequence[PageEntry]) -> str:
    """What stands between the markers of the README."""
    return f"{BEGIN}\n{overview(entries, 'docs/results.md#')}\n{END}"


def table(sheet: Table, left: int = 1) -> str:
    """A sheet without its title; so many columns at the left are text."""
    head, _, *body = sheet.to_markdown().partition("\n\n")[2].strip().split("\n")
    rule = [":--"] * left + ["--:"] * (len(sheet.columns) - left)
    return "\n".join([head, f"| {' | '.join(rule)} |", *body])


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
    for sheet in sheets(experiment, results):
        left = sheet.columns.index("variant") + 1 if "variant" in sheet.columns else 2
        notes = "".join(f"\n\n{note}" for note in sheet.notes)
        yield f"### {sheet.title}\n\n{table(replace(sheet, notes=()), left)}{notes}"


def _facts(entry: PageEntry) -> str:
    experiment, results = entry.experiment, entry.results
    have, of = done(experiment, results)
    spent = sum(line.wall_s for line in results.lines if line.world != POOLED)
    lines = [
        f"- command: `quadriga experiments {experiment.name}`",
        f"- seeds: {span(experiment.seeds)}; walked: {results.seeds or 'none'}",
        f"- trials: **{_count(have, of)}**" + (f", {duration(spent)} on one core" if have else ""),
        f"- baseline: {experiment.baseline}",
    ]
    lines += [f"- code and libraries: {versions}" for versions in results.versions]
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
    text = table(Table("", ("variant", "keys"), rows), left=2)
    for part in experiment.parts:
        if part.sweep is not None:
            labels = ", ".join(label for label, _ in part.sweep.values)
            text += f"\n\nSwept on {part.folder}: `{part.sweep.name}`, {part.axis}: {labels}."
    return text


def _key(key: str, value: Any) -> str:
    shown = str(value).lower() if isinstance(value, bool) else str(value)
    return f"{key} = {shown}"


def _count(have: int, of: int) -> str:
    return unbroken(f"{have:,} of {of:,}")


def _found(verdict: RequirementVerdict) -> str:
    """What was found in all worlds together, if that is asked, and where it stands worst."""
    worst = verdict.worst
    if worst is None:
        return NOTHING
    if len(verdict.findings) == 1:
        return finding_text(verdict, worst)
    pooled = [one for one in verdict.findings if one.world == POOLED and one.margin is not None]
    shown = dict.fromkeys((*pooled, worst))
    return "; ".join(f"{' · '.join(one.world)}: {finding_text(verdict, one)}" for one in shown)


def replaced(text: str, fragment: str) -> str | None:
    """A text with what stands between the markers replaced; None unless both stand there once."""
    if text.count(BEGIN) != 1 or text.count(END) != 1:
        return None
    head, _, rest = text.partition(BEGIN)
    _, found, tail = rest.partition(END)
    return f"{head}{fragment}{tail}" if found else None
