"""Requirements against what came of the walks: met or missed, and by how much."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

from quadriga.experiments.measures import MEASURES, Interval
from quadriga.experiments.published.experiment import Experiment, Requirement
from quadriga.experiments.results import POOLED, Line, Results, World

Word = Literal["met", "missed", "open"]
_SENSE: Final = {"least": "≥", "most": "≤", "below": "<"}
_BOUND: Final = {"value": "", "lower": ", lower 95 % bound", "upper": ", upper 95 % bound"}


@dataclass(frozen=True, slots=True)
class RequirementResult:
    """A requirement in one world, or in all together.

    Attributes:
        world: scenario and swept value, or `POOLED`.
        word: `open` if the trials there are do not give the figure.
        estimate: the figure with its interval, if there is one.
        margin: from what is held against the limit to the limit, in the measure's unit; negative
            if it is missed.
        whole: whether every trial has been walked.
        refused: why the variant was not walked.
    """

    world: World
    word: Word
    estimate: Interval | None = None
    margin: float | None = None
    whole: bool = False
    refused: str = ""


@dataclass(frozen=True, slots=True)
class RequirementVerdict:
    """A requirement of one variant, with what was found in each world that it is asked for in."""

    requirement: Requirement
    variant: str
    findings: tuple[RequirementResult, ...]

    @property
    def word(self) -> Word:
        """Missed if it is missed anywhere, open if that is open anywhere.

        One that is asked for in some of the worlds is met once it is met in enough of them.
        """
        words = {finding.word for finding in self.findings}
        if enough := self.requirement.at_least:
            met, open_still = (
                sum(finding.word == word for finding in self.findings) for word in ("met", "open")
            )
            return "met" if met >= enough else "open" if met + open_still >= enough else "missed"
        return "missed" if "missed" in words else "open" if "open" in words or not words else "met"

    @property
    def whole(self) -> bool:
        """Whether every trial that it rests on has been walked."""
        return all(finding.whole for finding in self.findings)

    @property
    def worst(self) -> RequirementResult | None:
        """Where least is left to the limit, or most is missing."""
        known = [finding for finding in self.findings if finding.margin is not None]
        return min(known, key=lambda finding: finding.margin or 0.0, default=None)


def judge_requirements(experiment: Experiment, results: Results) -> list[RequirementVerdict]:
    """Every requirement for each variant that it is asked of."""
    return [
        RequirementVerdict(
            requirement,
            variant,
            tuple(
                _judge(requirement, world, variant, results)
                for world in _worlds(experiment, requirement)
            ),
        )
        for requirement in experiment.requirements
        for variant in requirement.variants
    ]


def compute_margin(requirement: Requirement, interval: Interval) -> float | None:
    """How far a figure is on the right side of the limit; None if it has no such bound."""
    held = {"value": interval.value, "lower": interval.low, "upper": interval.high}[
        requirement.bound
    ]
    if held is None:
        return None
    return held - requirement.limit if requirement.sense == "least" else requirement.limit - held


def describe_requirement(requirement: Requirement, baseline: str) -> str:
    """The requirement in words."""
    measure = MEASURES[requirement.measure]
    unit = f" {measure.unit}" if measure.unit else ""
    often = f" in at least {requirement.at_least} worlds" if requirement.at_least else ""
    return (
        f"{measure.text.format(requirement.against or baseline)}{_BOUND[requirement.bound]} "
        f"{_SENSE[requirement.sense]} {requirement.limit:g}{unit}{often}"
    )


def _worlds(experiment: Experiment, requirement: Requirement) -> Sequence[World]:
    each = experiment.worlds() if requirement.each else []
    chosen = [w for w in each if not requirement.scenarios or w[0] in requirement.scenarios]
    return [*chosen, POOLED] if requirement.pooled else chosen


def _judge(
    requirement: Requirement, world: World, variant: str, results: Results
) -> RequirementResult:
    line = results.find(world, variant, requirement.against)
    if line is None:
        return RequirementResult(world, "open")
    whole = _is_whole(line)
    if MEASURES[requirement.measure].paired:
        whole &= _is_whole(results.find(world, requirement.against or results.baseline))
    if line.tally.refused:
        return RequirementResult(world, "missed", whole=whole, refused=line.tally.refused)
    estimate = MEASURES[requirement.measure].of(line)
    margin = None if estimate is None else compute_margin(requirement, estimate)
    if margin is None:
        return RequirementResult(world, "open", estimate, whole=whole)
    met = margin > 0.0 if requirement.sense == "below" else margin >= 0.0
    return RequirementResult(world, "met" if met else "missed", estimate, margin, whole)


def _is_whole(line: Line | None) -> bool:
    return line is not None and line.done >= line.wanted
