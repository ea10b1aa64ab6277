"""Variants as they are typed: every set of keys is one the configuration takes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.agents.predictor.predictor import KINDS
from quadriga.experiments.variants import (
    PLANNERS,
    PREDICTORS,
    Keys,
    Variant,
    combine_with_predictors,
    parse_variants,
    split_outside_brackets,
)
from quadriga.shared.config.load import build, layers
from quadriga.shared.errors import ConfigError


@pytest.mark.parametrize("variants", [PLANNERS, PREDICTORS])
def test_every_set_builds_a_configuration_of_its_own(variants: Mapping[str, Keys]) -> None:
    built = {name: build(layers(None, keys)) for name, keys in variants.items()}
    for name, config in built.items():
        for key, value in variants[name].items():
            section, _, field = key.partition(".")
            assert getattr(getattr(config, section), field) == value
    own = [config for name, config in built.items() if name != "configured"]
    assert len(set(own)) == len(own)


def test_every_fit_there_is_can_be_compared() -> None:
    assert set(KINDS) < set(PREDICTORS)


def test_every_planner_walks_with_every_predictor_and_nobody_with_none() -> None:
    variants = parse_variants(["none,damped,mine:planner.N=20"], None)
    assert combine_with_predictors(variants, ()) == variants
    found = combine_with_predictors(variants, ("pinv", "plain"))
    assert [variant.name for variant in found] == [
        "none",
        "damped+pinv",
        "damped+plain",
        "mine+pinv",
        "mine+plain",
    ]
    assert found[0].keys == PLANNERS["none"]
    assert found[2].keys == {**PLANNERS["damped"], **PREDICTORS["plain"]}
    for names, message in (
        (("?",), r"--predictors: got '\?', .*ridge.*paper"),
        (("pinv",) * 2, "each"),
    ):
        with pytest.raises(ConfigError, match=message):
            combine_with_predictors(variants, names)


def test_variants_are_names_keys_or_tables_of_a_file(tmp_path: Path) -> None:
    file = tmp_path / "low-level.toml"
    file.write_text(
        "[blind]\ncontroller.contact_detection = false\n\n[stiff]\n"
        '"controller.kp_tilt" = 2000.0\n\n[stiff.planner]\nkind = "none"\n',
        encoding="utf-8",
    )
    found = parse_variants(
        ["none,blind", "light:planner.kind=distributed;planner.R=[0.1,0.1,0.02]"], file
    )
    assert found == (
        Variant("none", PLANNERS["none"]),
        Variant("blind", {"controller.contact_detection": False}),
        Variant("light", {"planner.kind": "distributed", "planner.R": [0.1, 0.1, 0.02]}),
    )
    assert [v.name for v in parse_variants([], file)] == ["blind", "stiff"]
    assert parse_variants(["stiff"], file)[0].keys == {
        "controller.kp_tilt": 2000.0,
        "planner.kind": "none",
    }


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["clever"], "--planners: got 'clever', expected names of none"),
        (["none,none"], "none twice"),
        ([], "expected at least one of none"),
        (["a b:planner.kind=none"], "got 'a b'"),
        (["stiff:controller.kp_z"], "--planners: got 'controller.kp_z', expected section.key="),
    ],
)
def test_mistakes_in_variants_are_named(options: list[str], message: str) -> None:
    with pytest.raises(ConfigError) as error:
        parse_variants(options, None)
    assert message in str(error.value)


def test_a_file_of_something_else_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "variants.toml"
    file.write_text("planner = 3\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="no table of a plain name"):
        parse_variants([], file)


@settings(deadline=None)  # a busy machine is not the subject
@given(st.lists(st.from_regex(r"[a-z]{1,5}(\[[a-z,]{0,5}\])?", fullmatch=True), min_size=1))
def test_parts_are_split_at_marks_outside_of_brackets_alone(parts: list[str]) -> None:
    assert split_outside_brackets(",".join(parts), ",") == parts


def test_a_controller_of_ones_own_has_no_predictor() -> None:
    mine = "mine:team.agent_command=python walk.py --fast"
    variants = parse_variants([f"damped,{mine}"], None)
    assert dict(variants[1].keys) == {"team.agent_command": "python walk.py --fast"}
    found = combine_with_predictors(variants, ("pinv",))
    assert [variant.name for variant in found] == ["damped+pinv", "mine"]
