"""What is compiled before a team starts is all that its agents run in their own rehearsals."""

from __future__ import annotations

from typing import Any

import pytest

from quadriga.agents.planner import coupling, peer_terms, qp_solver
from quadriga.shared.config.load import load
from quadriga.warm_up import _rehearse_agent


@pytest.mark.parametrize("preset", ["usual", "fast", "paper"])
def test_the_planner_meets_a_peer_and_limits_of_its_qp(
    preset: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    solved, effects = [], []
    judge, fill = qp_solver.judge, coupling.fill_deviations

    def judged(*given: Any) -> qp_solver.QpSolution:
        solved.append(judge(*given))
        return solved[-1]

    def filled(*given: Any) -> None:
        effects.append(len(given))
        fill(*given)

    monkeypatch.setattr(qp_solver, "judge", judged)
    monkeypatch.setattr(peer_terms, "fill_deviations", filled)
    _rehearse_agent(load(None, {"planner.preset": preset, "gait.stand_ms": 500}))
    assert effects
    assert solved
    assert {answer.status for answer in solved} == {qp_solver.SOLVED}
    assert all(answer.iterations > 0 for answer in solved)
