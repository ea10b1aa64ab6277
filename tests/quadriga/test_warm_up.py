"""What is compiled before a team starts has a peer, and plans within and at its limits."""

from __future__ import annotations

from typing import Any

import pytest

from quadriga.agents.planner import compiled_step, coupling, peer_terms, qp_solver
from quadriga.agents.planner.foot_limits import WithinLimits, minimise_within
from quadriga.shared.config.load import load
from quadriga.warm_up import _rehearse_agent


@pytest.mark.parametrize("preset", ["usual", "fast", "paper"])
def test_the_planner_has_a_peer_and_plans_within_and_at_its_limits(
    preset: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    limited, planned, effects = [], [], []
    minimise, plan = minimise_within, compiled_step.CompiledStep.plan
    fill = coupling.fill_deviations

    def minimised(*given: Any) -> WithinLimits:
        limited.append(minimise(*given))
        return limited[-1]

    def planning(*given: Any) -> compiled_step.CompiledPlan | None:
        planned.append(plan(*given))
        return planned[-1]

    def filled(*given: Any) -> None:
        effects.append(len(given))
        fill(*given)

    monkeypatch.setattr(qp_solver, "minimise_within", minimised)
    monkeypatch.setattr(compiled_step.CompiledStep, "plan", planning)
    monkeypatch.setattr(peer_terms, "fill_deviations", filled)
    _rehearse_agent(load(None, {"planner.preset": preset, "gait.stand_ms": 500}))
    assert any(found is not None for found in planned)
    assert effects
    assert [found.solutions > 0 for found in limited] == [True]
