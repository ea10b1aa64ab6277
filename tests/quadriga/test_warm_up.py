"""What is compiled before a team starts has a peer and a plan."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.agents.planner import planner
from quadriga.agents.planner.peers import Peers
from quadriga.shared.config.load import load
from quadriga.warm_up import _rehearse_agent
from tests.agents.counting import count_calls


@pytest.mark.parametrize("preset", ["usual", "fast", "paper"])
def test_the_planner_has_a_peer_and_plans(preset: str, monkeypatch: pytest.MonkeyPatch) -> None:
    planned = count_calls(monkeypatch, planner, "_plan_step")
    effects = count_calls(monkeypatch, Peers, "terms")
    _rehearse_agent(load(None, {"planner.preset": preset, "gait.stand_ms": 500}))
    assert planned
    assert any(terms.peers and np.size(terms.effect) > 1 for terms in effects)
