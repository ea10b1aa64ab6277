"""The trials of a campaign: paired worlds, and which of several values of a key counts."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from quadriga.experiments.plan import CampaignPlan, Group, build_plan, with_seed
from quadriga.experiments.sweep import parse_sweep
from quadriga.experiments.variants import parse_variants
from quadriga.shared.errors import ConfigError

SCENARIO = '[team]\nrobots = 2\n\n[world]\nterrain = "boxes"\nduration = 8.0\nfriction = 0.7\n'


@pytest.fixture
def scenario(tmp_path: Path) -> str:
    path = tmp_path / "steps.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    return str(path)


def plan_of(scenario: str, planners: str, *sweeps: str, **given: Any) -> CampaignPlan:
    overrides = {name.replace("__", "."): value for name, value in given.items()}
    return build_plan(
        [scenario],
        parse_variants([planners], None),
        tuple(map(parse_sweep, sweeps)),
        (3, 5),
        None,
        None,
        overrides,
    )


def test_every_variant_walks_in_the_same_worlds(scenario: str) -> None:
    plan = plan_of(scenario, "distributed,none", "world.terrain_height=0.04,0.08")
    assert plan.baseline == "none"
    assert plan.trials() == [
        (Group("steps", variant, (height,)), seed)
        for height in ("0.04", "0.08")
        for variant in ("distributed", "none")
        for seed in (3, 5)
    ]
    for (group, seed), trial in zip(plan.trials(), plan.trials(), strict=True):
        config = with_seed(plan.configs[group], seed)
        assert (config.world.seed, config.world.mode) == (trial[1], "lockstep")
        assert config.world.terrain_height == float(group.swept[0])
        assert config.planner.kind == group.variant
    worlds = {
        (group.world, seed): with_seed(plan.configs[group], seed).world
        for group, seed in plan.trials()
    }
    assert len(set(worlds.values())) == len(worlds) == 4


def test_all_variants_walk_some_seeds_before_one_walks_them_all(scenario: str) -> None:
    plan = replace(plan_of(scenario, "none,decentralised"), seeds=tuple(range(20)))
    trials = plan.trials()
    assert len(set(trials)) == len(trials) == 2 * 20
    walked: Counter[int] = Counter()
    for _, seed in trials:
        walked[seed] += 1
        assert sum(count == 1 for count in walked.values()) <= 8, "seeds without their pair"


def test_later_values_of_a_key_win(scenario: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text("[world]\nduration = 5.0\n[reference]\nvx = 0.3\n", encoding="utf-8")
    variants = parse_variants(["plain:controller.preset=plain", "none"], None)
    plan = build_plan([scenario], variants, (), (0,), "plain", file, {"world.friction": 0.6})
    config = plan.configs[Group("steps", "plain", ())]
    assert config.team.robots == 2
    assert config.world.terrain == "boxes", "the scenario's"
    assert config.world.duration == 5.0, "the file's, not the scenario's"
    assert config.reference.vx == 0.3, "the file's"
    assert config.world.friction == 0.6, "the option's"
    assert config.controller.kp_tilt == 400.0, "the preset's"
    assert plan.configs[Group("steps", "none", ())].controller.kp_tilt == 1000.0


def test_a_preset_replaces_what_was_said_before_it_and_not_what_is_said_with_it(
    scenario: str,
) -> None:
    names = ["fast:planner.preset=fast", "late:planner.preset=fast;planner.latency_ms=5"]
    given = {"planner.latency_ms": 20, "planner.N": 20}
    plan = build_plan([scenario], parse_variants(names, None), (), (0,), None, None, given)
    fast, late = (plan.configs[Group("steps", name, ())].planner for name in ("fast", "late"))
    assert (fast.applied, fast.latency_ms, fast.N) == (1, 1, 20)
    assert (late.applied, late.latency_ms) == (1, 5)


@pytest.mark.parametrize(
    ("planners", "sweeps", "given", "message"),
    [
        ("none", ["planner.kind=none,deepc"], {}, "variant none: planner.kind"),
        ("none", ["world.terain=flat,boxes"], {}, "did you mean 'world.terrain'"),
        ("none", ["a.b=1", "a.b=2"], {}, "a key twice"),
        ("none", ["world.seed=1,2"], {}, "--sweep world.seed: got a key that a campaign sets"),
        ("none", ["world.mode=realtime,lockstep"], {}, "--sweep world.mode"),
        ("none", ["world.payload=5,5.0"], {}, "--sweep world.payload: got a value twice"),
        ("a-b:planner.kind=none,a_b:planner.kind=none", [], {}, "in more than punctuation"),
        ("none", [], {"world__seed": 4}, "expected --seeds"),
        ("none", [], {"world__push": "r9:80:90:3:0.2"}, "r9"),
        (
            "none",
            [],
            {"team__plant": "puppet"},
            "team.plant, team.plant_per_robot: got 'puppet', false, expected 'mujoco', false",
        ),
        ("none", ["world.payload_on=team,r7"], {"world__payload": 2.0}, "r7"),
        ("later:world.seed=3", [], {}, "variant later: world.seed"),
        (
            "now:planner.latency_ms=0",
            ["planner.preset=usual,fast"],
            {},
            "variant now: planner.latency_ms",
        ),
    ],
)
def test_what_cannot_be_compared_is_refused(
    scenario: str, planners: str, sweeps: list[str], given: dict[str, Any], message: str
) -> None:
    with pytest.raises(ConfigError) as error:
        plan_of(scenario, planners, *sweeps, **given)
    assert message in str(error.value)


def test_unknown_names_are_refused(scenario: str) -> None:
    variants = parse_variants(["none"], None)
    for names, baseline, message in (
        ([], None, "scenarios: got none"),
        (["moon"], None, "moon"),
        ([scenario], "deepc", "--baseline: got 'deepc'"),
    ):
        with pytest.raises(ConfigError, match=message):
            build_plan(names, variants, (), (0,), baseline, None, {})


def test_names_of_groups_are_names_of_files() -> None:
    assert Group("steps", "none", ("r1:80:90", "0.04")).name == "steps-none-r1_80_90-0.04"
