"""The tables of an experiment: requirements, what became of the walks, and pairs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Final

from quadriga.experiments.campaign.analysis import COST
from quadriga.experiments.campaign.sheets import p_text, unbroken
from quadriga.experiments.campaign.statistics import mcnemar
from quadriga.experiments.published.experiment import Experiment
from quadriga.experiments.published.measures import MEASURES, ratio
from quadriga.experiments.published.outcome_columns import COLUMNS
from quadriga.experiments.published.results import Beside, Line, Results
from quadriga.experiments.published.verdict import (
    RequirementResult,
    RequirementVerdict,
    stated,
    verdicts,
)
from quadriga.tables import NOTHING, Table

_MARK: Final = {"met": "met", "missed": "**missed**", "open": "open"}


def sheets(experiment: Experiment, results: Results) -> list[Table]:
    """Every table that is published of an experiment and that has a row."""
    published, found = experiment.published, [requirement_sheet(experiment, results)]
    if published.outcome:
        columns = [COLUMNS[name] for name in published.outcome]
        found.append(
            _sheet(
                "Walks",
                results.lines,
                [head for head, _ in columns],
                lambda line: [cell(line) for _, cell in columns],
            )
        )
    beside = [line for line in results.lines if line.beside is not None]
    base = experiment.baseline
    if published.falls:
        falls = (
            "pairs",
            "falls",
            f"of {base}",
            "alone",
            f"{base} alone",
            "difference [points]",
            "McNemar p",
        )
        found.append(_sheet(f"Falls against {base}", beside, falls, _falls))
    if published.ratios:
        names = published.ratios
        head = [f"RMSE {name}" if name != COST else "control cost" for name in names]
        found.append(
            _sheet(
                f"Errors over those of {base}",
                beside,
                ["pairs", *head],
                lambda line: _ratios(line, names),
            )
        )
    return [sheet for sheet in found if sheet.rows]


def requirement_sheet(experiment: Experiment, results: Results) -> Table:
    """Requirements as rows, worlds as columns."""
    found = verdicts(experiment, results)
    worlds = list(dict.fromkeys(one.world for verdict in found for one in verdict.findings))
    rows = []
    for verdict in found:
        cells = {finding.world: finding_text(verdict, finding) for finding in verdict.findings}
        rows.append(
            (
                asked(verdict, experiment),
                word_text(verdict),
                *(cells.get(world, NOTHING) for world in worlds),
            )
        )
    head = ("required", "verdict", *(" · ".join(world) for world in worlds))
    return Table("Required", head, tuple(rows))


def asked(verdict: RequirementVerdict, experiment: Experiment) -> str:
    """What is asked of whom."""
    hoped = "moonshot: " if verdict.requirement.moonshot else ""
    return f"{hoped}{verdict.variant}: {stated(verdict.requirement, experiment.baseline)}"


def word_text(verdict: RequirementVerdict) -> str:
    """Met, missed (and where) or open."""
    text = _MARK[verdict.word]
    missed = sum(finding.word == "missed" for finding in verdict.findings)
    if missed and len(verdict.findings) > 1:
        text += f" in {missed} of {len(verdict.findings)}"
    return text if verdict.whole or verdict.word == "open" else f"{text} so far"


def finding_text(verdict: RequirementVerdict, finding: RequirementResult) -> str:
    """The figure with its interval, and how far it is from the limit."""
    measure = MEASURES[verdict.requirement.measure]
    if finding.refused:
        return f"**missed**: refused, {finding.refused}"
    shown = NOTHING if finding.estimate is None else measure.shown(finding.estimate)
    if finding.margin is None:
        return shown if finding.estimate is None else f"{shown} open"
    text = f"{shown} {_MARK[finding.word]}"
    if measure.digits == "p":
        return text
    return text + unbroken(f" by {measure.written(abs(finding.margin), signed=False)}")


def _falls(line: Line) -> Iterator[str]:
    pairs = _beside(line).fell
    difference = MEASURES["fall-difference"].of(line)
    yield f"{pairs.total:,}"
    yield str(pairs.both + pairs.first)
    yield str(pairs.both + pairs.second)
    yield str(pairs.first)
    yield str(pairs.second)
    yield NOTHING if difference is None else MEASURES["fall-difference"].shown(difference)
    yield p_text(mcnemar(pairs))


def _ratios(line: Line, names: Sequence[str]) -> Iterator[str]:
    yield f"{_beside(line).upright:,}"
    for name in names:
        measure = MEASURES[ratio(name)]
        found = measure.of(line)
        yield NOTHING if found is None else measure.shown(found)


def _beside(line: Line) -> Beside:
    if line.beside is None:
        raise ValueError(f"{line.variant} in {line.world} is beside nothing")
    return line.beside


def _sheet(
    title: str,
    lines: Sequence[Line],
    columns: Sequence[str],
    cells: Callable[[Line], Iterable[str]],
) -> Table:
    """A row for each world and variant; the swept value has a column where there is one."""
    swept = any(line.swept for line in lines)
    head = ("scenario", *(("swept",) if swept else ()), "variant", *columns)
    rows = []
    for line in lines:
        place = (line.scenario, *((line.swept,) if swept else ()), line.variant)
        told = ("refused",) if line.tally.refused else tuple(cells(line))
        rows.append((*place, *told, *(NOTHING,) * (len(columns) - len(told))))
    refused = dict.fromkeys(
        f"{line.variant} was refused: {line.tally.refused}." for line in lines if line.tally.refused
    )
    return Table(title, head, tuple(rows), tuple(refused))
