"""A walk in real time is refused where agents alone would need more than a computer has."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count

import pytest

from quadriga.agents import tick_cost
from quadriga.agents.agent import Agent
from quadriga.agents.tick_cost import TickCost, check_cost, rehearse_in_time
from quadriga.shared.config.load import load
from quadriga.shared.errors import ProcessError


def test_the_last_ticks_count() -> None:
    ends = iter([0, *range(50_000_000, 50_000_000 + 300 * 250_000, 250_000)])
    cost = TickCost(lambda: next(ends))
    assert cost.mean_ms == 0.0
    for _ in range(301):  # the first took 50 ms: something was compiled
        cost.note()
    assert cost.mean_ms == pytest.approx(0.25)


@pytest.mark.parametrize(
    ("cost_ms", "agents", "cores", "refused"),
    [
        (0.3, 3, 2, False),
        (0.3, 10, 2, True),
        (0.3, 10, 4, False),
        (0.9, 1, 8, False),
        (1.1, 1, 8, True),  # a tick is one thread's work, however many cores there are
    ],
)
def test_what_agents_need_is_held_against_the_cores(
    cost_ms: float, agents: int, cores: int, refused: bool
) -> None:
    if not refused:
        check_cost("r1", cost_ms, agents, cores)
        return
    with pytest.raises(ProcessError, match=r"r1 in real time: got .* ms of processor time"):
        check_cost("r1", cost_ms, agents, cores)


@pytest.mark.parametrize(
    ("keys", "rejoins", "refused"),
    [
        ({"world.mode": "realtime"}, False, True),
        ({"world.mode": "realtime"}, True, False),
        ({"world.mode": "realtime", "runtime.check_cpu": False}, False, False),
        ({"world.mode": "lockstep"}, False, False),
    ],
)
def test_a_rehearsal_measures(
    monkeypatch: pytest.MonkeyPatch, keys: dict[str, object], rejoins: bool, refused: bool
) -> None:
    config = load(None, {"team.robots": 1, "planner.kind": "none", **keys})
    monkeypatch.setattr(tick_cost, "thread_ns", count(0, 2_000_000).__next__)
    agent = Agent(config, "r1", None)
    if not refused:
        rehearse_in_time(config, agent, refuse=not rejoins)
        return
    with pytest.raises(ProcessError, match=r"got 2\.00 ms .* at most 1\.00 ms, of one agent"):
        rehearse_in_time(config, agent, refuse=not rejoins)


def test_what_is_compiled_in_the_first_rehearsal_refuses_nobody(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It may be in the last ticks, where the planner first meets a limit."""
    config = load(None, {"team.robots": 1, "planner.kind": "none", "world.mode": "realtime"})
    rehearsals, taken = list[int](), 0

    def rehearse_once(config: object, agent: object, note: Callable[[], None]) -> None:
        nonlocal taken
        rehearsals.append(taken)
        for tick in range(300):
            taken += 200_000
            if len(rehearsals) == 1 and tick == 290:
                taken += 700_000_000
            note()

    monkeypatch.setattr(tick_cost, "rehearse", rehearse_once)
    monkeypatch.setattr(tick_cost, "thread_ns", lambda: taken)
    rehearse_in_time(config, Agent(config, "r1", None), refuse=True)
    assert len(rehearsals) == 2
    rehearse_in_time(config, Agent(config, "r1", None), refuse=True)
    assert len(rehearsals) == 3, "who is fast enough rehearses once"
