"""Every number of every kind of message has one name of its own."""

from __future__ import annotations

from dataclasses import fields
from math import prod

import numpy as np
import pytest

from quadriga.export.layout import build_layout
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Measurement, Plan, State, Status, Truth
from quadriga.shared.topics import TABLE, TICKS, Topic


@pytest.mark.parametrize(
    "topic", [t for t in TABLE if t is not TICKS], ids=lambda topic: topic.name
)
def test_there_are_as_many_names_as_numbers(topic: Topic) -> None:
    layout = build_layout(topic.type, load(None, {"team.robots": 4, "team.yokes": "ring"}), {})
    length = {"n": 4, "k": 4, "N": 1}
    shapes = [item.metadata.get("shape", ("P",)) for item in fields(topic.type)]
    counts = [prod(length.get(d, d) for d in s) for s in shapes if s[0] not in ("P", "K")]
    assert len(layout.numbers) == len(set(layout.numbers)) == sum(counts)
    named = {*layout.lists, *(name for name, _ in layout.plain)}
    assert not named & {name.split(".")[0] for name in layout.numbers}


def test_names_tell_robot_field_leg_and_axis() -> None:
    state = build_layout(State, Config(), {}).numbers
    assert state[:3] == ("q_joint.FL_hip", "q_joint.FL_thigh", "q_joint.FL_calf")
    assert state[-1] == "foot_force.RR"
    assert build_layout(Measurement, Config(), {}).numbers[12] == "y.z"
    truth = build_layout(Truth, Config(), {}).numbers
    assert {"r2.base_pos.y", "r3.grf.RL.z", "r1-r3.yoke_force"} <= {*truth}


def test_numbers_stand_under_their_names() -> None:
    rng = np.random.default_rng(0)
    layout = build_layout(Truth, load(None, {"team.robots": 2}), {})
    arrays = {
        item.name: rng.random([{"n": 2, "k": 1}.get(d, d) for d in item.metadata["shape"]])
        for item in fields(Truth)
        if "shape" in item.metadata
    }
    truth = Truth(5, 5, ("r1", "r2"), **arrays)
    numbers = layout.numbers_of(truth)
    assert numbers is not None
    by_name = dict(zip(layout.numbers, numbers[0].tolist(), strict=True))
    assert by_name["r2.grf.RL.z"] == truth.grf[1, 2, 2]
    assert by_name["r1.base_quat_wxyz.z"] == truth.base_quat_wxyz[0, 3]
    assert by_name["r1-r2.yoke_force"] == truth.yoke_force[0]
    other = build_layout(Truth, load(None, {"team.robots": 3}), {})
    assert other.numbers_of(truth) is None, "of another team"


def test_a_plan_of_nothing_has_no_row() -> None:
    nothing = Plan(40, 0, 1, np.zeros((0, 12)), np.zeros((0, 6)), "solved", {"r2": 0}, 0)
    numbers = build_layout(Plan, Config(), {"used": ("r2",)}).numbers_of(nothing)
    assert numbers is not None
    assert len(numbers) == 0


def test_maps_have_the_names_that_occur_whatever_they_are() -> None:
    entries = {"ages_ms": ("plan.r1", "plan_r1", "", "état"), "counters": ("n",)}
    layout = build_layout(Status, Config(), entries)
    assert layout.numbers == (
        "ages_ms.plan_r1",
        "ages_ms.plan_r1_",
        "ages_ms._",
        "ages_ms._tat",
        "counters.n",
    )
    nothing = np.zeros(0)
    status = Status(0, 0, "walk", "", "kalman", {"plan_r1": 7.0}, {"n": 2}, nothing, nothing)
    numbers = layout.numbers_of(status)
    np.testing.assert_array_equal(numbers, [[np.nan, 7.0, np.nan, np.nan, 2.0]])


def test_a_plan_has_a_row_for_each_sample() -> None:
    layout = build_layout(Plan, Config(), {"used": ("r2",)})
    plan = Plan(0, 0, 0, np.arange(36.0).reshape(3, 12), np.zeros((3, 6)), "solved", {"r2": 4}, 0)
    numbers = layout.numbers_of(plan)
    assert numbers is not None
    assert numbers.shape == (3, 19)
    assert layout.sampled == 18
    assert numbers[2, layout.numbers.index("u.FR.x")] == 27.0
    assert numbers[:, -1].tolist() == [4.0, 4.0, 4.0]
