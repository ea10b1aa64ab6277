"""Variants and swept keys as they are typed, and what the mistakes cost."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.experiments.campaign.choice import Sweep, Variant, parted, sweep_of, variants_of
from quadriga.experiments.trial.variants import PLANNERS
from quadriga.shared.errors import ConfigError


def test_variants_are_names_keys_or_tables_of_a_file(tmp_path: Path) -> None:
    file = tmp_path / "low-level.toml"
    file.write_text(
        "[blind]\ncontroller.contact_detection = false\n\n[stiff]\n"
        '"controller.kp_tilt" = 2000.0\n\n[stiff.planner]\nkind = "none"\n',
        encoding="utf-8",
    )
    found = variants_of(
        ["none,blind", "light:planner.kind=distributed;planner.R=[0.1,0.1,0.02]"], file
    )
    assert found == (
        Variant("none", PLANNERS["none"]),
        Variant("blind", {"controller.contact_detection": False}),
        Variant("light", {"planner.kind": "distributed", "planner.R": [0.1, 0.1, 0.02]}),
    )
    assert [v.name for v in variants_of([], file)] == ["blind", "stiff"]
    assert variants_of(["stiff"], file)[0].keys == {
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
        variants_of(options, None)
    assert message in str(error.value)


def test_a_file_of_something_else_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "variants.toml"
    file.write_text("planner = 3\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="no table of a plain name"):
        variants_of([], file)


def test_a_key_is_swept_through_values_or_through_a_part_of_a_text() -> None:
    assert sweep_of("world.terrain_height=0.04,0.1") == Sweep(
        "world.terrain_height", "", (("0.04", 0.04), ("0.1", 0.1))
    )
    assert sweep_of("planner.kind=none,deepc").values == (("none", "none"), ("deepc", "deepc"))
    push = sweep_of("world.push=r1:{80,120}:90:3:0.2,r2:{}:270:4:0.2")
    assert push.name == "world.push = r1:{}:90:3:0.2,r2:{}:270:4:0.2"
    assert push.values == (
        ("80", "r1:80:90:3:0.2,r2:80:270:4:0.2"),
        ("120", "r1:120:90:3:0.2,r2:120:270:4:0.2"),
    )


@pytest.mark.parametrize(
    "option", ["world.push", "height=3", "world.push=", "a.b=1,1", "a.b={1,2}x{3}", "a.b={}"]
)
def test_mistakes_in_sweeps_are_named(option: str) -> None:
    with pytest.raises(ConfigError, match="--sweep: got"):
        sweep_of(option)


@settings(deadline=None)  # a busy machine is not the subject
@given(st.lists(st.from_regex(r"[a-z]{1,5}(\[[a-z,]{0,5}\])?", fullmatch=True), min_size=1))
def test_parts_are_split_at_marks_outside_of_brackets_alone(parts: list[str]) -> None:
    assert parted(",".join(parts), ",") == parts
