"""What the low level is asked to do of what the operator wants and what is planned."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from quadriga.agents.agent import Agent, Outputs
from quadriga.agents.controller.controller import ControllerOutputs, Task
from quadriga.agents.controller.schedule import Schedule
from quadriga.identification.rollout import Rollout
from quadriga.shared.config.sections import Config, TeamConfig
from quadriga.shared.robot.conventions import Array
from quadriga.shared.wire.messages import Plan
from quadriga.shared.wire.topics import SAMPLE_MS
from tests.agents.duet import every_100_ms, simple_predictor

ALONE = Config(team=TeamConfig(robots=1))
STANCE_MS = ALONE.gait.stance_ms


class Watched:
    """One robot that walks; what its low level is asked to do, and its plan in force."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, **planner: Any) -> None:
        self.config = replace(ALONE, planner=replace(ALONE.planner, latency_ms=0, **planner))
        predictor = simple_predictor(self.config)
        self.rollout = Rollout(self.config, predictor, every_100_ms)
        self.asked: list[tuple[int, Schedule, Task, Plan]] = []
        self._plan: Plan | None = None
        agent: Agent = self.rollout.agents["r1"]
        act = agent._controller.act

        def seen(
            at: Any, schedule: Schedule, task: Task, *rest: Any, **named: Any
        ) -> ControllerOutputs:
            self._tasks.append((schedule, task))
            return act(at, schedule, task, *rest, **named)

        self._tasks: list[tuple[Schedule, Task]] = []
        monkeypatch.setattr(agent._controller, "act", seen)

    def walk(self, until: int) -> Watched:
        for tick in self.rollout.ticks(until):
            outputs: Outputs = tick.outputs["r1"]
            self._plan = outputs.plan or self._plan
            if self._plan is not None:
                self.asked.append((tick.tick, *self._tasks[-1], self._plan))
        return self


def v_ref(tick: int, plan: Plan) -> Array:
    """Planned vx, vy from the sample of `tick` on."""
    return plan.y[(tick - plan.tick) // SAMPLE_MS :, 1:3]


def test_planned_speeds_are_tracked_with_the_interface_force(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen = Watched(monkeypatch, interface="force").walk(600).asked
    assert len(seen) > 200
    for tick, _, task, plan in seen:
        np.testing.assert_array_equal([task.vx, task.vy], v_ref(tick, plan)[0])
        assert task.ahead is None


def test_all_planned_outputs_are_tracked_if_that_is_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen = Watched(monkeypatch, interface="force", tracked="outputs").walk(600).asked
    assert len(seen) > 200
    for tick, _, task, plan in seen:
        asked = [task.height, task.vx, task.vy, task.roll, task.pitch, task.wz]
        np.testing.assert_array_equal(asked, plan.y[(tick - plan.tick) // SAMPLE_MS])
    tilts = {task.roll for _, _, task, _ in seen} | {task.pitch for _, _, task, _ in seen}
    assert len(tilts) > 50


def test_by_default_speeds_are_the_operators_and_footholds_count_on_what_is_measured(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen = Watched(monkeypatch).walk(600).asked
    assert len(seen) > 200
    for tick, _, task, _ in seen:
        asked = every_100_ms(tick - tick % 100)
        assert asked is not None
        assert (task.vx, task.vy) == (asked.vx, asked.vy)
        assert task.ahead is None


def test_planned_footholds_count_on_the_way_to_the_middle_of_the_stance_to_come(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen = Watched(monkeypatch, footholds="planned").walk(800).asked
    assert len(seen) > 400
    speeds, reached = set(), set()
    for tick, schedule, task, plan in seen:
        ahead_ms = (1.0 - schedule.progress) * STANCE_MS + 0.5 * STANCE_MS
        assert task.ahead is not None
        wanted = max(1, round(ahead_ms / SAMPLE_MS))
        planned = v_ref(tick, plan)[:wanted]
        reached.add(len(planned) == wanted)
        np.testing.assert_allclose(task.ahead, planned.mean(axis=0), atol=1e-12)
        assert task.vy == 0.0
        speeds.add(float(task.ahead[0]))
    assert len(speeds) > 50
    assert reached == {True, False}, "plans that reach so far, and plans that end before"
