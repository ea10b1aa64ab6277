"""What an operator asks for is obeyed as it is; jumps between corners are not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadriga.agents.inbox.inbox import Inbox
from quadriga.agents.planning.interface import Expected
from quadriga.agents.planning.reference_slew import ReferenceSlew, most_change
from quadriga.shared.codec import encode
from quadriga.shared.config.load import load
from quadriga.shared.messages import Reference
from quadriga.team.operator import reference_at
from quadriga.team.scenarios import path
from tests.a1 import standing

TRACE = "t,vx,vy,wz\n0,0,0,0\n0.35,1.2,-0.5,1\n0.4,-1,0.5,-1\n"


def reference(tick: int, vx: float = 0.0, wz: float = 0.0, height: float = 0.26) -> Reference:
    return Reference(tick, 0, vx, 0.0, wz, height)


@pytest.mark.parametrize(
    "keys",
    [
        {},
        {"reference.ramp": 0.0, "reference.vx": 1.2, "reference.wz": -1.0},
        {"reference.ramp": 0.05, "reference.vx": -1.0, "reference.vy": 0.5},
        {"reference.ramp": 0.0, "reference.trace": TRACE.replace("\n", ";").rstrip(";")},
        {"reference.trace": "joystick.csv", "reference.trace_shift": 30.0, "world.seed": 5},
        {"team.robot": "go2"},
    ],
    ids=["usual", "at once", "steep", "jumping trace", "joystick", "go2"],
)
def test_what_the_configured_operator_asks_for_is_left_alone(keys: dict[str, Any]) -> None:
    config = load(None, keys)
    slew = ReferenceSlew(config)
    for tick in range(0, 20_000, 100):
        asked = reference_at(config, tick)
        assert slew.limit(asked) is asked


def test_corners_are_approached_and_not_jumped_to() -> None:
    slew, most = ReferenceSlew(load()), most_change(load())
    given = [slew.limit(reference(0))]
    for k in range(1, 40):
        sign = 1 if k % 2 else -1
        given.append(slew.limit(reference(100 * k, 1.2 * sign, sign, 0.32 if k % 2 else 0.2)))
    for name, limit in zip(("vx", "wz", "height"), most[[0, 2, 3]], strict=True):
        values = np.array([getattr(each, name) for each in given])
        assert np.abs(np.diff(values)).max() <= limit + 2e-9
    assert np.abs([each.vx for each in given]).max() <= 0.23


def test_a_speed_that_is_asked_for_long_enough_is_reached() -> None:
    slew = ReferenceSlew(load())
    slew.limit(reference(0))
    assert slew.limit(reference(100, 1.2)).vx == pytest.approx(0.22)
    assert slew.limit(reference(300, 1.2)).vx == pytest.approx(0.66)
    assert slew.limit(reference(1000, 1.2)).vx == 1.2
    assert slew.limit(reference(500, 1.2)).vx == pytest.approx(1.1), "by the one before it"


def test_the_first_is_believed() -> None:
    assert ReferenceSlew(load()).limit(reference(7000, 1.2)).vx == 1.2


def test_an_agent_takes_in_what_is_left_of_a_jump() -> None:
    box = Inbox(load(None, {"world.mode": "realtime"}), "r1", ())
    for tick, vx in ((0, 0.0), (100, 1.2), (200, -1.0)):
        box.take("team/reference", encode(reference(tick, vx)))
    taken = box.pop_inputs(standing(0), Expected()).references
    assert [each.vx for each in taken] == pytest.approx([0.0, 0.22, 0.0])


def test_a_trace_that_this_computer_lacks_is_no_error() -> None:
    config = load(None, {"reference.trace": "elsewhere.csv"})
    assert most_change(config)[0] == pytest.approx(0.22)


def test_every_scenario_of_the_project_is_left_alone() -> None:
    for file in sorted(Path(path("flat")).parent.glob("*.toml")):
        config = load(file)
        slew = ReferenceSlew(config)
        for tick in range(0, 10_000, 100):
            asked = reference_at(config, tick)
            assert slew.limit(asked) is asked, file
