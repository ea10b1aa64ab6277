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
from quadriga.shared.config.sections import Config, TeamConfig
from quadriga.shared.messages import Plan
from quadriga.shared.robots.conventions import Array
from quadriga.shared.topics import SAMPLE_MS
from tests.agents.duet import every_100_ms, simple_predictor

ALONE = Config(team=TeamConfig(robots=1))


class Watched:
    """One robot that walks; what its low level is asked to do, and its plan in force."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, **planner: Any) -> None:
        self.config = replace(ALONE, planner=replace(ALONE.planner, latency_ms=0, **planner))
        predictor = simple_predictor(self.config)
        self.rollout = Rollout(self.config, predictor, every_100_ms)
        self.asked: list[tuple[int, TrunkCommand, Plan]] = []
        self._plan: Plan | None = None

        def seen(state: Any, command: TrunkCommand, gains: Array, **named: Any) -> Any:
            self._tasks.append(command)
            return control(state, command, gains, **named)

        self._tasks: list[TrunkCommand] = []
        monkeypatch.setattr(agent_module, "control", seen)

    def walk(self, until: int) -> Watched:
        for tick in self.rollout.ticks(until):
            outputs: Outputs = tick.outputs["r1"]
            self._plan = outputs.plan or self._plan
            if self._plan is not None:
                self.asked.append((tick.tick, self._tasks[-1], self._plan))
        return self


def v_ref(tick: int, plan: Plan) -> Array:
    """Planned vx, vy at the sample of `tick`."""
    return plan.y[(tick - plan.tick) // SAMPLE_MS, 1:3]


def test_planned_speeds_are_tracked_with_the_interface_force(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen = Watched(monkeypatch, interface="force").walk(600).asked
    assert len(seen) > 200
    for tick, task, plan in seen:
        np.testing.assert_array_equal([task.vx, task.vy], v_ref(tick, plan))


def test_all_planned_outputs_are_tracked_if_that_is_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen = Watched(monkeypatch, interface="force", tracked="outputs").walk(600).asked
    assert len(seen) > 200
    for tick, task, plan in seen:
        asked = [task.height, task.vx, task.vy, task.roll, task.pitch, task.wz]
        np.testing.assert_array_equal(asked, plan.y[(tick - plan.tick) // SAMPLE_MS])
    tilts = {task.roll for _, task, _ in seen} | {task.pitch for _, task, _ in seen}
    assert len(tilts) > 50


def test_by_default_speeds_are_the_operators(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = Watched(monkeypatch).walk(600).asked
    assert len(seen) > 200
    for tick, task, _ in seen:
        asked = every_100_ms(tick - tick % 100)
        assert asked is not None
        assert (task.vx, task.vy) == (asked.vx, asked.vy)
