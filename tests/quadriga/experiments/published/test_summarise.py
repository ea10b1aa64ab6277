"""From rows to what is published: counts, pairs, all worlds together, and what no longer fits."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from quadriga.experiments.campaign.choice import Variant, sweep_of
from quadriga.experiments.campaign.plan import Group
from quadriga.experiments.campaign.statistics import Pairs
from quadriga.experiments.published.experiment import Experiment, Part
from quadriga.experiments.published.results import Ratio, Results, from_json, to_json
from quadriga.experiments.published.summarise import POOLED, done, fitting, summarise
from quadriga.shared.errors import ConfigError
from tests.quadriga.experiments.published.made import (
    Fate,
    experiment_of,
    manifest_of,
    rows_of,
    upright,
)


def of(experiment: Experiment, seeds: range, fate: Fate, **changes: Any) -> Results:
    rows = rows_of(experiment.groups(), seeds, fate)
    return summarise(experiment, [(manifest_of(experiment, **changes), rows)])


def fate(group: Group, seed: int) -> dict[str, Any]:
    """On steps 0 … 3 fall without the variant and 0 with it; its errors are half as large."""
    if group.scenario == "steps" and seed < (1 if group.variant == "mine" else 4):
        return {"fell": 2.0}
    return {"error": 0.01 if group.variant == "mine" else 0.02}


def test_a_line_for_each_world_and_variant_and_for_all_together() -> None:
    experiment = experiment_of("steps", "ice")
    found = of(experiment, range(10), fate)
    assert [(line.scenario, line.variant, line.done, line.wanted) for line in found.lines] == [
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
    assert (found.seeds, found.versions) == ("0 … 9", ("code 1",))
    assert done(experiment, found) == (40, 40)


def test_few_pairs_have_no_interval() -> None:
    found = of(experiment_of("ice"), range(5), fate).find(("ice",), "mine")
    assert found is not None
    assert found.beside is not None
    assert found.beside.ratios["roll"] == Ratio(5, 0.5, None, None)


def test_what_is_not_walked_yet_is_counted() -> None:
    experiment = experiment_of("steps", "ice")
    found = of(experiment, range(3), fate)
    assert done(experiment, found) == (12, 40)
    assert done(experiment, Results()) == (0, 40)
    only_steps = [
        row
        for row in rows_of(experiment.groups(), range(3), fate)
        if row.scenario == "steps" and row.variant == "none"
    ]
    found = summarise(experiment, [(manifest_of(experiment), only_steps)])
    assert [line.wanted for line in found.lines] == [10, 20]
    assert done(experiment, found) == (3, 40)
    more = replace(experiment, seeds=(0, 1))
    assert done(more, of(more, range(2), fate)) == (8, 8)


def test_seeds_beyond_those_of_the_file_are_left_out() -> None:
    experiment = experiment_of("ice")
    found = of(experiment, range(5, 15), upright)
    assert found.seeds == "5 … 9"
    assert done(experiment, found) == (10, 20)


def test_the_same_values_of_another_swept_key_are_other_worlds() -> None:
    heights, frictions = (
        experiment_of("ice", parts=(Part("ice", ("ice",), sweep_of(f"world.{key}=0.1,0.2"), key),))
        for key in ("terrain_height", "friction")
    )
    walked = manifest_of(heights), rows_of(heights.groups(), range(10), upright)
    assert done(heights, summarise(heights, [walked])) == (40, 40)
    assert done(frictions, summarise(frictions, [walked])) == (0, 40)


def test_trials_of_other_keys_worlds_or_variants_are_left_out() -> None:
    experiment = experiment_of("steps", "ice")
    rows = rows_of(experiment.groups(), range(10), fate)
    changed = replace(
        experiment, variants=(experiment.variants[0], Variant("mine", {"team.robots": 3}))
    )
    found = summarise(changed, [(manifest_of(experiment), rows)])
    assert {line.variant for line in found.lines} == {"none"}
    assert done(changed, found) == (20, 40)
    fewer = experiment_of("steps")
    found = summarise(fewer, [(manifest_of(experiment), rows)])
    assert [line.world for line in found.lines] == [("steps",), ("steps",)]


def test_published_results_say_the_same_again() -> None:
    experiment = experiment_of("steps", "ice")
    text = to_json(of(experiment, range(7), fate))
    again = from_json(text, "kept.json")
    assert to_json(again) == text
    assert again == from_json(to_json(again), "kept.json")
    assert fitting(experiment, again) == again
    assert text.count("\n") == 15  # a line for each of six lines


def test_published_results_of_another_file_are_left_out() -> None:
    experiment = experiment_of("steps", "ice")
    kept = from_json(to_json(of(experiment, range(10), fate)), "kept.json")
    none, mine = experiment.variants
    changed = replace(experiment, variants=(none, Variant("mine", {"team.robots": 3})))
    assert {line.variant for line in fitting(changed, kept).lines} == {"none"}
    changed = replace(experiment, variants=(Variant("none", {}), mine))
    assert [line.beside for line in fitting(changed, kept).lines] == [None] * 3
    fewer = experiment_of("steps")
    assert [line.world for line in fitting(fewer, kept).lines] == [("steps",)] * 2
    more = replace(experiment, seeds=tuple(range(30)))
    assert [line.wanted for line in fitting(more, kept).lines] == [30] * 4 + [60] * 2
    assert fitting(experiment_of("snow"), kept) == Results()
    assert fitting(replace(experiment, seeds=tuple(range(1, 11))), kept) == Results()


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"format": 2}', '{"format": 1, "lines": [3]}'])
def test_what_is_no_published_result_is_one_error(text: str) -> None:
    with pytest.raises(ConfigError, match=r"kept\.json: got .*edited by hand"):
        from_json(text, "kept.json")
