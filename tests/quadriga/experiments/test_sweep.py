"""Swept keys as they are typed, and what the mistakes cost."""

from __future__ import annotations

import pytest

from quadriga.experiments.sweep import Sweep, order_values, parse_sweep
from quadriga.shared.errors import ConfigError


def test_a_key_is_swept_through_values_or_through_a_part_of_a_text() -> None:
    assert parse_sweep("world.terrain_height=0.04,0.1") == Sweep(
        "world.terrain_height", "", (("0.04", 0.04), ("0.1", 0.1))
    )
    assert parse_sweep("planner.kind=none,deepc").values == (("none", "none"), ("deepc", "deepc"))
    push = parse_sweep("world.push=r1:{80,120}:90:3:0.2,r2:{}:270:4:0.2")
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
        parse_sweep(option)


def test_swept_numbers_are_ordered_by_size_and_texts_come_after() -> None:
    assert sorted(["10", "9", "b", "a", "0.5"], key=lambda value: order_values([value])) == [
        "0.5",
        "9",
        "10",
        "a",
        "b",
    ]
