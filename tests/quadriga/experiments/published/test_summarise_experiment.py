"""From rows to what is published: counts, pairs, all worlds together, and what no longer fits."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from quadriga.experiments.plan import Group
from quadriga.experiments.published.experiment import Experiment, Part
from quadriga.experiments.published.summarise_experiment import count_trials, summarise_experiment
from quadriga.experiments.results import POOLED, Ratio, Results
from quadriga.experiments.statistics import Pairs
from quadriga.experiments.sweep import parse_sweep
from quadriga.experiments.variants import Variant
from tests.quadriga.experiments.published.made import (
    Fate,
    experiment_of,
    manifest_of,
    rows_of,
    upright,
)


def of(experiment: Experiment, seeds: range, fate: Fate, **changes: Any) -> Results:
    rows = rows_of(experiment.groups(), seeds, fate)
    return summarise_experiment(experiment, [(manifest_of(experiment, **changes), rows)])


def fate(group: Group, seed: int) -> dict[str, Any]:
    """On steps 0 … 3 fall without the variant and 0 with it; its errors are half as large."""
    if group.scenario == "steps" and seed < (1 if group.variant == "mine" else 4):
        return {"fell": 2.0}
    return {"error": 0.01 if group.variant == "mine" else 0.02}


def test_a_line_for_each_world_and_variant_and_for_all_together() -> None:
    experiment = experiment_of("steps", "ice")
    found = of(experiment, range(10), fate)
    assert [(line.world[0], line.variant, line.done, line.wanted) for line in found.lines] == [
        ("steps", "none", 10, 10),
        ("steps", "mine", 10, 10),
        ("ice", "none", 10, 10),
        ("ice", "mine", 10, 10),
        ("all worlds", "none", 20, 20),
        ("all worlds", "mine", 20, 20),
    ]
    assert [line.tally.falls for line in found.lines] == [4, 1, 0, 0, 4, 1]
    steps, pooled = found.find(("steps",), "mine"), found.find(POOLED, "mine")
    assert steps is not None
    assert steps.beside is not None
    assert steps.beside.fell == Pairs(both=1, first=0, second=3, neither=6)
    assert steps.beside.ratios["roll"] == Ratio(6, 0.5, 0.5, 0.5)
    assert steps.beside.ratios["cost"].median == pytest.approx(0.25)
    assert pooled is not None
    assert pooled.beside is not None
    assert pooled.beside.fell == Pairs(1, 0, 3, 16)
    assert pooled.beside.ratios["roll"].pairs == 16
    assert found.lines[0].beside is None
    assert (found.seeds, found.versions) == (tuple(range(10)), ("code 1",))
    assert count_trials(experiment, found) == (40, 40)


def test_few_pairs_have_no_interval() -> None:
    found = of(experiment_of("ice"), range(5), fate).find(("ice",), "mine")
    assert found is not None
    assert found.beside is not None
    assert found.beside.ratios["roll"] == Ratio(5, 0.5, None, None)


def test_what_is_not_walked_yet_is_counted() -> None:
    experiment = experiment_of("steps", "ice")
    found = of(experiment, range(3), fate)
    assert count_trials(experiment, found) == (12, 40)
    assert count_trials(experiment, of(experiment, range(0), fate)) == (0, 40)
    only_steps = [
        row
        for row in rows_of(experiment.groups(), range(3), fate)
        if row.scenario == "steps" and row.variant == "none"
    ]
    found = summarise_experiment(experiment, [(manifest_of(experiment), only_steps)])
    assert [line.wanted for line in found.lines] == [10, 20]
    assert count_trials(experiment, found) == (3, 40)
    more = replace(experiment, seeds=(0, 1))
    assert count_trials(more, of(more, range(2), fate)) == (8, 8)


def test_seeds_beyond_those_of_the_file_are_left_out() -> None:
    experiment = experiment_of("ice")
    found = of(experiment, range(5, 15), upright)
    assert found.seeds == (5, 6, 7, 8, 9)
    assert count_trials(experiment, found) == (10, 20)


def test_the_same_values_of_another_swept_key_are_other_worlds() -> None:
    heights, frictions = (
        experiment_of(
            "ice", parts=(Part("ice", ("ice",), parse_sweep(f"world.{key}=0.1,0.2"), key),)
        )
        for key in ("terrain_height", "friction")
    )
    walked = manifest_of(heights), rows_of(heights.groups(), range(10), upright)
    assert count_trials(heights, summarise_experiment(heights, [walked])) == (40, 40)
    assert count_trials(frictions, summarise_experiment(frictions, [walked])) == (0, 40)


def test_trials_of_other_keys_worlds_or_variants_are_left_out() -> None:
    experiment = experiment_of("steps", "ice")
    rows = rows_of(experiment.groups(), range(10), fate)
    changed = replace(
        experiment, variants=(experiment.variants[0], Variant("mine", {"team.robots": 3}))
    )
    found = summarise_experiment(changed, [(manifest_of(experiment), rows)])
    assert {line.variant for line in found.lines} == {"none"}
    assert count_trials(changed, found) == (20, 40)
    fewer = experiment_of("steps")
    found = summarise_experiment(fewer, [(manifest_of(experiment), rows)])
    assert [line.world for line in found.lines] == [("steps",), ("steps",)]


def test_what_the_baseline_was_before_is_compared_with_nothing() -> None:
    experiment = experiment_of("steps", "ice")
    walked = manifest_of(experiment), rows_of(experiment.groups(), range(10), fate)
    changed = replace(experiment, variants=(Variant("none", {}), experiment.variants[1]))
    found = summarise_experiment(changed, [walked])
    assert [(line.variant, line.beside) for line in found.lines] == [("mine", None)] * 3
    more = replace(experiment, seeds=tuple(range(30)))
    found = summarise_experiment(more, [walked])
    assert [line.wanted for line in found.lines] == [30] * 4 + [60] * 2
    nothing = summarise_experiment(experiment_of("snow"), [walked])
    assert (nothing.lines, nothing.versions) == ((), ())
