"""Files of experiments: those of the project, and what each mistake in one costs."""

from __future__ import annotations

import itertools
from contextlib import chdir
from dataclasses import replace
from pathlib import Path

import pytest

from quadriga.experiments.plan import Group
from quadriga.experiments.published.catalogue import CHECKOUT, FOLDER, list_names, load_experiments
from quadriga.experiments.published.experiment_file import read_experiment
from quadriga.experiments.published.walk_experiment import build_plans
from quadriga.experiments.variants import PLANNERS
from quadriga.shared.config.load import build, layers
from quadriga.shared.config.write import departures
from quadriga.shared.errors import ConfigError

SMALL = """
title = "Small"
question = "Is it so?"
scenarios = ["flat", "turn"]
planners = ["none"]
seeds = "0:3"
[common]
world.duration = 1.0
[variants.soft]
controller.kp_tilt = 500.0
planner.kind = "none"
[[requirements]]
measure = ["ratio-z", "ratio-vy"]
most = 0.8
over = ["each", "all"]
[[requirements]]
measure = "success"
least = 97
variants = ["none", "soft"]
scenarios = ["turn"]
moonshot = true
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "small.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_name_and_its_file_are_the_same() -> None:
    file = str((FOLDER / "paper.toml").relative_to(CHECKOUT))
    with chdir(CHECKOUT):
        assert load_experiments([file, "paper"])[1] == ["paper"]


def test_a_file_is_a_whole_experiment(tmp_path: Path) -> None:
    found = read_experiment(written(tmp_path, SMALL))
    assert (found.name, found.title, found.baseline) == ("small", "Small", "none")
    assert found.seeds == (0, 1, 2)
    none, soft = found.variants
    assert none.keys == {"world.duration": 1.0, **PLANNERS["none"]}
    assert soft.keys == {"world.duration": 1.0, "controller.kp_tilt": 500.0, "planner.kind": "none"}
    assert found.groups() == [
        Group("flat", "none", ()),
        Group("flat", "soft", ()),
        Group("turn", "none", ()),
        Group("turn", "soft", ()),
    ]
    z, vy, success = found.requirements
    assert (z.measure, z.sense, z.limit, z.bound) == ("ratio-z", "most", 0.8, "value")
    assert (z.variants, z.each, z.pooled, z.moonshot) == (("soft",), True, True, False)
    assert vy.measure == "ratio-vy"
    assert (success.variants, success.scenarios) == (("none", "soft"), ("turn",))
    assert (success.each, success.pooled, success.moonshot) == (True, False, True)
    assert found.published.falls
    assert found.published.figures == ("success",)


def test_a_requirement_names_whom_it_compares_with_and_in_how_many_worlds(tmp_path: Path) -> None:
    more = '[[requirements]]\nmeasure = "fall-ratio"\nvariants = "none"\nagainst = "soft"\n'
    path = written(tmp_path, SMALL + more + "below = 1\nat_least = 1\n")
    found = read_experiment(path).requirements
    assert [(one.against, one.at_least) for one in found] == [("", 0)] * 3 + [("soft", 1)]
    with pytest.raises(ConfigError, match="against: got 'hard', expected one of none, soft"):
        read_experiment(written(tmp_path, SMALL + more.replace('"soft"', '"hard"') + "below = 1\n"))


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("at_least = 0", "at_least: got 0, expected a whole number ≥ 1 and ≤ 2, its worlds"),
        ("at_least = 3", "at_least: got 3, expected"),
        ("at_least = 1.5", "at_least: got 1.5, expected"),
        ("at_least = inf", "at_least: got inf, expected a finite number"),
        ('scenarios = "flat"\nat_least = 2', "at_least: got 2, .* ≤ 1"),
        ('over = ["each", "all"]\nat_least = 1', "at_least: got 1 with over"),
        ('over = ["each", "all"]\nscenarios = ["flat"]', "scenarios: got flat with over"),
        ('variants = "soft"\nagainst = "soft"', "it compares with soft, of which it is asked"),
    ],
)
def test_a_requirement_that_nothing_can_meet_is_refused(
    tmp_path: Path, more: str, message: str
) -> None:
    asked = f'[[requirements]]\nmeasure = "fall-ratio"\nbelow = 1\n{more}\n'
    with pytest.raises(ConfigError, match=message):
        read_experiment(written(tmp_path, SMALL + asked))


def test_only_pairs_are_held_against_another_variant(tmp_path: Path) -> None:
    asked = '[[requirements]]\nmeasure = "success"\nleast = 9\nagainst = "soft"\n'
    with pytest.raises(ConfigError, match="against: got 'soft', expected none"):
        read_experiment(written(tmp_path, SMALL + asked))


def test_what_is_swept_makes_a_campaign_of_each_scenario(tmp_path: Path) -> None:
    text = SMALL.partition("[[requirements]]")[0] + (
        '[sweep.flat]\nkeys = "world.payload=0,5"\naxis = "load [kg]"\n'
        '[sweep.turn]\nkeys = "world.push=r1:{80,120}:90:3:0.2"\n'
    )
    found = read_experiment(written(tmp_path, text))
    assert [part.folder for part in found.parts] == ["flat", "turn"]
    assert [part.axis for part in found.parts] == ["load [kg]", "world.push = r1:{}:90:3:0.2"]
    assert found.worlds() == [("flat", "0"), ("flat", "5"), ("turn", "80"), ("turn", "120")]
    plans = build_plans(found)
    assert [len(plan.trials()) for _, plan in plans] == [12, 12]
    fewer = replace(found, seeds=(7,))
    assert [len(plan.trials()) for _, plan in build_plans(fewer)] == [4, 4]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("title", "titel", r"small.toml: a key: got 'titel', .*did you mean 'title'"),
        ('"Is it so?"', '""', "question: got '', expected text"),
        ('question = "Is it so?"', "", "question: got nothing, expected text"),
        ('"turn"]\np', '"tern"]\np', "scenarios: got 'tern', expected one of"),
        ('["flat", "turn"]', "[]", "scenarios: got none"),
        ('["flat", "turn"]', "3", "scenarios: got 3, expected a list of texts"),
        ('["flat", "turn"]', '["flat", "flat"]', "expected each once"),
        ('["none"]', '["clever"]', r"small.toml: planners: got 'clever', expected names of none"),
        ("variants.soft", "variants.none", "planners and variants: got none, none"),
        ('"0:3"', '"3:0"', "seeds: got '3:0', expected at least one seed"),
        ('"0:3"', "3", "seeds: got 3, expected text"),
        (
            "[common]",
            '[publish]\noutcome = ["trails"]\n[common]',
            "publish: outcome: got 'trails', .*did you mean 'trials'",
        ),
        ("[common]", '[publish]\nratios = ["x"]\n[common]', "publish: ratios: got 'x'"),
        ("[common]", '[publish]\nfigures = "swep"\n[common]', "did you mean 'sweep'"),
        ("[common]", '[publish]\nfalls = "yes"\n[common]', "falls: got 'yes', expected true or"),
        ("[common]", "[publish]\ncolour = 1\n[common]", "publish: a key: got 'colour'"),
        (
            "[common]",
            '[sweep.flat]\nkeys = "world.payload=1,2"\n[common]',
            "sweep: turn: keys: got nothing",
        ),
        ("[common]", '[sweep.flat]\nkeys = "payload"\n[common]', "flat: keys: got 'payload', exp"),
        (
            '"success"\n',
            '"fall-ratio"\n',
            "the 2.: measure: got 'fall-ratio', .* of which it is asked",
        ),
        ("least = 97", 'least = 97\nmeasure = "falls"', "TOML"),
        ('"success"\nleast = 97', '"falls"\nmost = 0\nbound = "upper"', "falls has no interval"),
        ('["flat", "turn"]', '["turn"]', "the 1.: over: got all, expected each"),
        ("most = 0.8", "", "requirements, the 1.: got no limit, expected one of least"),
        ("most = 0.8", "most = 0.8\nleast = 0.1", "the 1.: got least, most"),
        ("most = 0.8", 'most = "0.8"', "most: got '0.8', expected a finite number"),
        ("most = 0.8", 'most = 0.8\nbound = "uper"', "did you mean 'upper'"),
        ("ratio-z", "ratio-q", "the 1.: measure: got 'ratio-q'"),
        ('["ratio-z", "ratio-vy"]', "[]", "measure and over: got nothing"),
        ('"all"]', '"al"]', "over: got 'al', .*did you mean 'all'"),
        ('["none", "soft"]', '["hard"]', "the 2.: variants: got 'hard'"),
        ('["turn"]', '["ramp"]', "the 2.: scenarios: got 'ramp'"),
        ("[[requirements]]", "[requirements]", "TOML"),
        ('planners = ["none"]', 'planners = ["none"]\nbaseline = "soft2"', "baseline: got 'soft2'"),
        ("[variants.soft]", "[variants.'so/ft']", "variants: so/ft: got no table of a plain name"),
        ("[common]", "common = 3\n[x]", "a key: got 'x'"),
        ("title", "= title", "TOML"),
    ],
)
def test_a_mistake_is_one_clear_error(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in SMALL
    with pytest.raises(ConfigError, match=message):
        read_experiment(written(tmp_path, SMALL.replace(old, new)))


@pytest.mark.parametrize("name", list_names())
def test_every_experiment_of_the_project_can_be_walked(name: str) -> None:
    """Its scenarios, keys and values are right, and all its worlds can be built."""
    every, asked = load_experiments([name])
    assert asked == [name]
    (found,) = (experiment for experiment in every if experiment.name == name)
    configs = [config for _, plan in build_plans(found) for config in plan.configs.values()]
    assert len(configs) == len(found.groups())
    assert len(set(configs)) == len(configs), "no variant is another by another name"


def test_what_is_promised_can_be_walked_and_is_not_published() -> None:
    found = read_experiment(CHECKOUT / "deploy" / "acceptance.toml")
    assert found.name not in list_names()
    trials = [trial for _, plan in build_plans(found) for trial in plan.trials()]
    assert len(trials) == 3 * len(found.groups()) == 21
    assert {one.measure for one in found.requirements} >= {"success", "slowest", "max-z"}


def test_from_the_paper_to_the_default_one_thing_changes_at_a_time() -> None:
    """A key, or a preset with what it sets; the default is among the steps, but for the gate."""
    experiment = read_experiment(FOLDER / "as-written.toml")
    configs = {v.name: build(layers(None, dict(v.keys))) for v in experiment.variants}
    assert next(iter(configs)) == "as-written"
    for before, after in itertools.pairwise(configs.values()):
        changed = {key for key, *_ in departures(after, before)}
        sections = {key.partition(".")[0] for key in changed}
        if len(changed - {"planner.preset"}) > 1:
            weights = {"planner.Q", "planner.R"}
            cooperative = {"planner.cost", "planner.exchanges"}
            of_the_data = ("predictor", "noise", "wrench_noise", "disturbed")
            with_its_data = {f"identification.{key}" for key in of_the_data}
            together = changed in (weights, cooperative, with_its_data)
            assert together or sections == {"controller"}
    left = {key for key, *_ in departures(configs["damped"], build({}))}
    gate = {"identification.max_radius", "identification.max_peers_harm"}
    assert left == {"world.duration", *gate}


def test_all_that_are_promised_are_there_in_order() -> None:
    assert list_names() == (
        "paper",
        "as-written",
        "hard",
        "edge",
        "distribution",
        "low-level",
        "realism",
        "ideas",
        "beyond",
        "ten",
        "sweeps",
    )


def test_a_name_that_is_none_tells_the_one_that_is_like_it(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"got 'papers', expected .* TOML file .*mean 'paper'"):
        load_experiments(["papers"])
    namesake = tmp_path / "paper.toml"
    namesake.write_text(SMALL, encoding="utf-8")
    with pytest.raises(ConfigError, match="there is an experiment 'paper'"):
        load_experiments([str(namesake)])
    with pytest.raises(ConfigError, match="none\\.toml: got No such file"):
        load_experiments([str(tmp_path / "none.toml")])
