"""A rehearsal goes through everything that a walk may come to."""

from __future__ import annotations

from typing import Any

import pytest

from agents.agent import Agent
from agents.modes import WALK
from agents.planner import qp_solver
from agents.rehearsal import rehearse
from shared.config import Config, TeamConfig
from tests.agents.duet import simple_predictor

ALONE = Config(team=TeamConfig(robots=1))


def test_limits_of_both_qps_are_met(monkeypatch: pytest.MonkeyPatch) -> None:
    """Their first solve would otherwise load code in mid-walk: 40 ms."""
    judged: list[int] = []
    judge = qp_solver.judge

    def counting(*arguments: Any) -> qp_solver.Solution:
        answer = judge(*arguments)
        judged.append(answer.iterations)
        return answer

    monkeypatch.setattr(qp_solver, "judge", counting)
    state = rehearse(ALONE, Agent(ALONE, "r1", simple_predictor(ALONE)))
    assert state.mode.name == WALK
    assert state.counters["qp_constrained"] > 0
    assert max(judged) > 0
