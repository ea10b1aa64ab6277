"""What is compiled before a team starts has a peer, and plans within and at its limits."""

from __future__ import annotations

from typing import Any

import pytest

from quadriga.agents.planner import coupling, free_step, peer_terms, qp_solver
from quadriga.shared.config.load import load
from quadriga.warm_up import _rehearse_agent


@pytest.mark.parametrize("preset", ["usual", "fast", "paper"])
def test_the_planner_has_a_peer_and_plans_within_and_at_its_limits(
    preset: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    solved, freely, effects = [], [], []
    judge, plan, fill = qp_solver.judge, free_step.FreeStep.plan, coupling.fill_deviations

    def judged(*given: Any) -> qp_solver.QpSolution:
        solved.append(judge(*given))
        return solved[-1]

    def planned(*given: Any) -> free_step.FreePlan | None:
        freely.append(plan(*given))
        return freely[-1]

    def filled(*given: Any) -> None:
        effects.append(len(given))
        fill(*given)

    monkeypatch.setattr(qp_solver, "judge", judged)
    monkeypatch.setattr(free_step.FreeStep, "plan", planned)
    monkeypatch.setattr(peer_terms, "fill_deviations", filled)
    _rehearse_agent(load(None, {"planner.preset": preset, "gait.stand_ms": 500}))
    assert any(found is not None for found in freely)
    assert effects
    assert [(answer.status, answer.iterations > 0) for answer in solved] == [
        (qp_solver.SOLVED, True)
    ]
