"""Requirements as text: what is asked, what was found, and whether it is met."""

from __future__ import annotations

from typing import Final

from quadriga.experiments.measures import MEASURES, keep_together
from quadriga.experiments.published.experiment import Experiment
from quadriga.experiments.published.verdicts import (
    RequirementResult,
    RequirementVerdict,
    describe_requirement,
    judge_requirements,
)
from quadriga.experiments.results import Results
from quadriga.tables import NOTHING, Table

_MARK: Final = {"met": "met", "missed": "**missed**", "open": "open"}


def build_requirement_table(experiment: Experiment, results: Results) -> Table:
    """Requirements as rows, worlds as columns."""
    verdicts = judge_requirements(experiment, results)
    worlds = list(dict.fromkeys(one.world for verdict in verdicts for one in verdict.findings))
    rows = []
    for verdict in verdicts:
        cells = {finding.world: format_finding(verdict, finding) for finding in verdict.findings}
        rows.append(
            (
                format_requirement(verdict, experiment),
                format_word(verdict),
                *(cells.get(world, NOTHING) for world in worlds),
            )
        )
    head = ("required", "verdict", *(" · ".join(world) for world in worlds))
    return Table("Required", head, tuple(rows))


def format_requirement(verdict: RequirementVerdict, experiment: Experiment) -> str:
    """What is asked of whom."""
    hoped = "moonshot: " if verdict.requirement.moonshot else ""
    asked = describe_requirement(verdict.requirement, experiment.baseline)
    return f"{hoped}{verdict.variant}: {asked}"


def format_word(verdict: RequirementVerdict) -> str:
    """Met, missed (and where) or open."""
    text = _MARK[verdict.word]
    asked = len(verdict.findings)
    if verdict.requirement.at_least:
        met = sum(finding.word == "met" for finding in verdict.findings)
        text += f", met in {met} of {asked}" if verdict.word != "open" else ""
    elif asked > 1:
        missed = sum(finding.word == "missed" for finding in verdict.findings)
        text += f" in {missed} of {asked}" if missed else ""
    return text if verdict.whole or verdict.word == "open" else f"{text} so far"


def format_finding(verdict: RequirementVerdict, finding: RequirementResult) -> str:
    """The figure with its interval, and how far it is from the limit."""
    measure = MEASURES[verdict.requirement.measure]
    if finding.refused:
        return f"**missed**: refused, {finding.refused}"
    shown = NOTHING if finding.estimate is None else measure.format_interval(finding.estimate)
    if finding.margin is None:
        return shown if finding.estimate is None else f"{shown} open"
    text = f"{shown} {_MARK[finding.word]}"
    if measure.digits == "p":
        return text
    return text + keep_together(f" by {measure.format_value(abs(finding.margin), signed=False)}")
