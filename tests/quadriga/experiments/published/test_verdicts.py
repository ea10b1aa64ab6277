"""Met, missed or open, against cases that were computed by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from quadriga.experiments.measures import MEASURES, Interval
from quadriga.experiments.published.experiment import Requirement
from quadriga.experiments.published.requirement_table import format_finding, format_word
from quadriga.experiments.published.verdicts import (
    RequirementResult,
    RequirementVerdict,
    compute_margin,
    describe_requirement,
    judge_requirements,
)
from quadriga.experiments.results import POOLED, Beside, Line, Ratio, Results
from quadriga.experiments.statistics import Pairs
from quadriga.experiments.summarise import tally_trials
from tests.quadriga.experiments.published.made import experiment_of
from tests.quadriga.experiments.rows import row

NOBODY = Pairs(0, 0, 0, 0)


def line(
    successes: int = 0,
    falls: int = 0,
    fell: Pairs | None = None,
    ratio: Ratio | None = None,
    **changes: Any,
) -> Line:
    """Of so many walks to the end and so many falls."""
    rows = [row(seed=k) for k in range(successes)]
    rows += [row(seed=successes + k, fell=1.0) for k in range(falls)]
    ratios = {} if ratio is None else {"roll": ratio}
    beside = None if fell is None and ratio is None else Beside(fell or NOBODY, 0, ratios)
    line = Line(("steps",), "mine", len(rows), len(rows), 1.0, tally_trials(rows), beside)
    return replace(line, **changes)


def found(measure: str, of: Line) -> tuple[float | None, ...] | None:
    estimate = MEASURES[measure].of(of)
    return None if estimate is None else (estimate.value, estimate.low, estimate.high)


def test_measures_are_what_the_counts_say() -> None:
    # Wilson of 10 in 10: its lower end is 1 / (1 + 1.959964² / 10).
    assert found("success", line(10)) == pytest.approx((100.0, 72.2467, 100.0), abs=1e-3)
    assert found("fall-rate", line(0, 10)) == pytest.approx((100.0, 72.2467, 100.0), abs=1e-3)
    assert found("falls", line(8, 2)) == (2.0, None, None)
    # Fagerland et al. (2014): 2 and 8 of 21, 1 of both.
    assert found("fall-difference", line(fell=Pairs(1, 1, 7, 12))) == pytest.approx(
        (-600 / 21, -50.7, -2.6), abs=0.05
    )
    assert found("fall-ratio", line(fell=Pairs(1, 1, 7, 12))) == (0.25, None, None)
    assert found("fall-ratio", line(fell=Pairs(0, 1, 0, 12))) == (math.inf, None, None)
    assert found("fewer-falls", line(fell=Pairs(3, 0, 8, 9))) == (2 / 2**8, None, None)
    assert found("ratio-roll", line(ratio=Ratio(9, 0.75, 0.7, 0.9))) == (0.75, 0.7, 0.9)


def test_what_falls_more_never_has_a_small_p() -> None:
    assert found("fewer-falls", line(fell=Pairs(3, 8, 0, 9))) == (1.0, None, None)


@pytest.mark.parametrize(
    ("measure", "of"),
    [
        ("success", line()),
        ("falls", line()),
        ("fall-difference", line(3)),
        ("fall-difference", line(fell=NOBODY)),
        ("fall-ratio", line(fell=Pairs(0, 0, 0, 12))),  # nobody ever fell
        ("fewer-falls", line(3)),
        ("ratio-roll", line(3)),
        ("ratio-z", line(ratio=Ratio(9, 0.75, 0.7, 0.9))),
        ("ratio-roll", line(ratio=Ratio(0, None, None, None))),
        ("p99", line(3)),
    ],
)
def test_what_the_trials_do_not_give_is_open(measure: str, of: Line) -> None:
    assert found(measure, of) is None
    (verdict,) = judge(Requirement(measure, "most", 1.0, variants=("mine",)), of)
    assert verdict.word == "open"
    assert verdict.worst is None


@pytest.mark.parametrize(
    ("sense", "limit", "bound", "margin"),
    [
        ("least", 97.0, "value", 1.0),
        ("least", 97.0, "lower", -2.0),
        ("most", 97.0, "value", -1.0),
        ("most", 99.0, "value", 1.0),
        ("most", 99.0, "upper", -0.5),
        ("below", 98.0, "value", 0.0),
    ],
)
def test_the_margin_is_to_the_right_side_of_the_limit(
    sense: Any, limit: float, bound: Any, margin: float
) -> None:
    asked = Requirement("success", sense, limit, bound)
    assert compute_margin(asked, Interval(98.0, 95.0, 99.5)) == margin


def test_a_missing_bound_is_not_judged() -> None:
    asked = Requirement("ratio-roll", "most", 1.0, "upper")
    assert compute_margin(asked, Interval(0.7)) is None


def judge(requirement: Requirement, *lines: Line) -> list[RequirementVerdict]:
    """Of the variant `mine` in the worlds `steps` and `ice`."""
    experiment = experiment_of("steps", "ice", requirements=(requirement,))
    return judge_requirements(
        experiment, Results("none", ("none", "mine"), (("steps",), ("ice",)), lines=lines)
    )


@pytest.mark.parametrize(
    ("falls", "word", "text"),
    [
        (3, "met", "97.0 [91.5, 99.0] met by 0.0"),  # at the limit is met
        (4, "missed", "96.0 [90.2, 98.4] **missed** by 1.0"),
    ],
)
def test_at_least_97_of_100(falls: int, word: str, text: str) -> None:
    asked = Requirement("success", "least", 97.0, variants=("mine",), scenarios=("steps",))
    (verdict,) = judge(asked, line(100 - falls, falls))
    (finding,) = verdict.findings
    assert (verdict.word, finding.word, finding.whole) == (word, word, True)
    assert format_finding(verdict, finding).replace("\N{NO-BREAK SPACE}", " ") == text


def test_below_is_not_at() -> None:
    asked = Requirement("fewer-falls", "below", 2 / 2**8, variants=("mine",), scenarios=("steps",))
    (at,) = judge(asked, line(fell=Pairs(0, 0, 8, 9)))
    (under,) = judge(asked, line(fell=Pairs(0, 0, 9, 9)))
    assert (at.word, under.word) == ("missed", "met")
    assert format_finding(under, under.findings[0]) == "0.0039 met"


def test_falls_are_held_against_the_upper_bound() -> None:
    asked = Requirement("fall-difference", "most", 2.0, "upper", ("mine",), ("steps",))
    (less,) = judge(asked, line(fell=Pairs(1, 1, 7, 12)))  # −28.6 [−50.7, −2.6]
    (more,) = judge(asked, line(fell=Pairs(14, 5, 0, 22)))  # +12.2 [1.1, 22.6]
    (same,) = judge(asked, line(fell=Pairs(0, 0, 0, 300)))  # 0 [−1.3, 1.3], of Wilson's 3.84 / 304
    assert [verdict.word for verdict in (less, more, same)] == ["met", "missed", "met"]
    margins = [verdict.findings[0].margin for verdict in (less, more, same)]
    assert margins == pytest.approx([4.6, -20.6, 0.736], abs=0.06)


def test_every_world_and_all_together_must_meet_it() -> None:
    asked = Requirement("falls", "most", 1.0, variants=("mine",), pooled=True)
    good, bad = line(9, 1), line(5, 5, world=("ice",))
    both = line(14, 6, world=POOLED)
    (verdict,) = judge(asked, good, bad, both)
    assert [finding.word for finding in verdict.findings] == ["met", "missed", "missed"]
    assert (verdict.word, format_word(verdict)) == ("missed", "**missed** in 2 of 3")
    assert verdict.worst is not None
    assert verdict.worst.world == POOLED
    (verdict,) = judge(asked, good, replace(good, world=("ice",)))
    assert verdict.word == "open", "all together is not known"
    (verdict,) = judge(replace(asked, each=False), both)
    assert [finding.world for finding in verdict.findings] == [POOLED]


def test_what_is_not_walked_to_its_end_is_met_so_far_at_most() -> None:
    asked = Requirement("falls", "most", 1.0, variants=("mine",), scenarios=("steps",))
    (verdict,) = judge(asked, line(9, 1, wanted=200))
    assert (verdict.word, verdict.whole, format_word(verdict)) == ("met", False, "met so far")
    (verdict,) = judge(asked, line(8, 2, wanted=200))
    assert format_word(verdict) == "**missed** so far"


def test_pairs_whose_other_half_is_not_walked_are_met_so_far() -> None:
    asked = Requirement("ratio-roll", "most", 1.0, variants=("mine",), scenarios=("steps",))
    mine = line(9, ratio=Ratio(9, 0.9, 0.8, 1.0))
    for done, said in ((9, "met"), (3, "met so far")):
        other = line(done, variant="none", wanted=9)
        (verdict,) = judge(asked, mine, other)
        assert format_word(verdict) == said
    (verdict,) = judge(asked, mine)
    assert format_word(verdict) == "met so far"


def test_a_refused_variant_misses_everything() -> None:
    asked = Requirement("falls", "most", 1.0, variants=("mine",), scenarios=("steps",))
    refused = line(tally=tally_trials([row(refused="radius 0.9, not at most 0.5", success=False)]))
    (verdict,) = judge(asked, refused)
    assert verdict.word == "missed"
    assert "refused, radius 0.9" in format_finding(verdict, verdict.findings[0])


def test_a_requirement_is_said_in_words() -> None:
    for asked, text in (
        (Requirement("success", "least", 97.0), "success ≥ 97 %"),
        (
            Requirement("fall-difference", "most", 2.0, "upper"),
            "fall rate less that of none, upper 95 % bound ≤ 2 points",
        ),
        (Requirement("ratio-roll", "most", 0.8), "RMSE of roll over that of none, median ≤ 0.8"),
        (Requirement("fewer-falls", "below", 0.01), "McNemar's p of falling less than none < 0.01"),
    ):
        assert describe_requirement(asked, "none") == text
    assert (
        RequirementVerdict(asked, "mine", (RequirementResult(("steps",), "open"),)).word == "open"
    )


@pytest.mark.parametrize(
    ("words", "verdict"),
    [
        (("met", "met", "missed"), "met"),
        (("met", "missed", "missed"), "missed"),
        (("met", "open", "missed"), "open"),
        (("missed", "open", "missed"), "missed"),
    ],
)
def test_some_worlds_may_be_enough(words: tuple[Any, ...], verdict: str) -> None:
    asked = Requirement("fall-ratio", "below", 1.0, variants=("mine",), at_least=2)
    findings = tuple(RequirementResult((f"w{k}",), word) for k, word in enumerate(words))
    of_mine = RequirementVerdict(asked, "mine", findings)
    assert of_mine.word == verdict
    count = "" if verdict == "open" else f", met in {words.count('met')} of 3 so far"
    assert format_word(of_mine).replace("*", "") == verdict + count
    assert (
        describe_requirement(asked, "none") == "falls over those of none < 1 in at least 2 worlds"
    )


def test_a_measure_of_pairs_may_be_against_another_variant_than_the_baseline() -> None:
    asked = Requirement("ratio-roll", "most", 1.03, variants=("mine",), against="best")
    beside_baseline = line(ratio=Ratio(9, 0.9, 0.8, 1.0))
    beside_best = line(ratio=Ratio(9, 1.1, 1.0, 1.2))
    results = Results(
        "none", ("none", "best", "mine"), (("steps",),), lines=(beside_baseline,),
        lines_against={"best": (beside_best,)},
    )  # fmt: skip
    (verdict,) = judge_requirements(experiment_of("steps", requirements=(asked,)), results)
    assert verdict.word == "missed"
    assert verdict.findings[0].estimate == Interval(1.1, 1.0, 1.2)
    assert "over that of best" in describe_requirement(asked, "none")
