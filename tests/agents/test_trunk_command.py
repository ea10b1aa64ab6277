"""What the low level is asked to do of what the operator wants and what is planned."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from quadriga.agents import agent as agent_module
from quadriga.agents.agent import Outputs
from quadriga.agents.controller.controller import control
from quadriga.agents.controller.trunk import TrunkCommand
from quadriga.identification.rollout import Rollout
from quadriga.shared.messages import Plan
from quadriga.shared.robots.conventions import Array
from quadriga.shared.topics import SAMPLE_MS
from tests.agents.duet import every_100_ms, simple_predictor
from tests.agents.lone_robot import ALONE


@pytest.mark.parametrize(
    ("planner", "tracked"),
    [
        ({"interface": "force"}, "speeds"),
        ({"interface": "force", "tracked": "outputs"}, "outputs"),
        ({}, "the operator's speeds"),
    ],
)
def test_what_the_low_level_tracks(
    monkeypatch: pytest.MonkeyPatch, planner: dict[str, Any], tracked: str
) -> None:
    config = replace(ALONE, planner=replace(ALONE.planner, latency_ms=0, **planner))
    rollout = Rollout(config, simple_predictor(config), every_100_ms)
    asked, tilts = list[TrunkCommand](), set[float]()
    plan: Plan | None = None

    def seen(state: Any, command: TrunkCommand, gains: Array, **named: Any) -> Any:
        asked.append(command)
        return control(state, command, gains, **named)

    monkeypatch.setattr(agent_module, "control", seen)
    compared = 0
    for tick in rollout.ticks(600):
        outputs: Outputs = tick.outputs["r1"]
        plan = outputs.plan or plan
        if plan is None:
            continue
        compared += 1
        task, planned = asked[-1], plan.y[(tick.tick - plan.tick) // SAMPLE_MS]
        tilts |= {task.roll, task.pitch}
        if tracked == "outputs":
            all_six = [task.height, task.vx, task.vy, task.roll, task.pitch, task.wz]
            np.testing.assert_array_equal(all_six, planned)
            continue
        operator = every_100_ms(tick.tick - tick.tick % 100)
        assert operator is not None
        speeds = planned[1:3] if tracked == "speeds" else [operator.vx, operator.vy]
        np.testing.assert_array_equal([task.vx, task.vy], speeds)
    assert compared > 200
    assert tracked != "outputs" or len(tilts) > 50
