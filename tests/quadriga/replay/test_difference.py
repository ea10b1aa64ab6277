"""The first difference names the field, the place and both values."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from quadriga.replay.difference import find_difference
from quadriga.shared.codec import encode
from quadriga.shared.messages import Command, Plan, Truth

COMMAND_0 = Command(7, 7_000_000, *(np.arange(12.0) + 20 * k for k in range(5)))
PLAN_0 = Plan(40, 40, 1, np.zeros((3, 12)), np.zeros((3, 6)), "solved", {"r1": 0}, 0)


@given(
    name=st.sampled_from(["tau", "q_des", "v_des", "kp", "kd"]),
    place=st.integers(0, 11),
    ulps=st.integers(1, 1000),
)
def test_any_changed_bit_of_a_command_is_placed(name: str, place: int, ulps: int) -> None:
    values = getattr(COMMAND_0, name).copy()
    bits = values.view(np.int64)
    bits[place] += ulps
    found = find_difference(7, "command", encode(COMMAND_0), replace(COMMAND_0, **{name: values}))
    assert (found.tick, found.name, found.field) == (7, "command", f"{name}[{place}]")
    assert float(found.recorded) == getattr(COMMAND_0, name)[place]
    assert float(found.recomputed) == values[place]
    assert found.others == "1 of 12 entries differ"


def test_negative_zero_is_not_zero() -> None:
    u = PLAN_0.u.copy()
    u[2, 5] = -0.0
    found = find_difference(40, "plan", encode(PLAN_0), replace(PLAN_0, u=u))
    assert (found.field, found.recorded, found.recomputed) == ("u[2, 5]", "0.0", "-0.0")


def test_plain_fields_shapes_and_what_is_no_message() -> None:
    other = replace(PLAN_0, status="faded", used={"r1": 1}, u=np.ones((3, 12)))
    text = str(find_difference(40, "plan", encode(PLAN_0), other))
    assert text.startswith("tick 40, plan.u[0, 0]: recorded 0.0, recomputed 1.0 (36 of 36 entries")
    assert "also in status, used" in text
    shorter = replace(PLAN_0, u=np.zeros((2, 12)), y=np.zeros((2, 6)))
    text = str(find_difference(40, "plan", encode(PLAN_0), shorter))
    assert "plan.u: recorded (3, 12), recomputed (2, 12)" in text
    text = str(find_difference(40, "plan", encode(PLAN_0), replace(PLAN_0, status="faded")))
    assert text == "tick 40, plan.status: recorded 'solved', recomputed 'faded'"
    assert "no message" in str(find_difference(40, "plan", b"\xc1", PLAN_0))


def test_every_field_of_a_message_is_compared() -> None:
    three, quat, yoke = np.zeros((1, 3)), np.zeros((1, 4)), np.zeros(1)
    grf = np.zeros((1, 4, 3))
    truth = Truth(3, 3, ("r1",), three, quat, three, three, grf, yoke, yoke)
    for item in fields(Truth):
        value = getattr(truth, item.name)
        other = -value if isinstance(value, np.ndarray) else ("r2",) if value == ("r1",) else 4
        changed: dict[str, Any] = {item.name: other}
        found = find_difference(3, "k", encode(replace(truth, **changed)), truth)
        assert found.field.startswith(item.name)
