"""Agents that answer each other's plans within a planning step."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from quadriga.agents.planner.peers import PeerData, Peers
from quadriga.agents.planning.interface import Expected
from quadriga.agents.planning.local import LocalPlanning
from quadriga.identification.rollout import Rollout
from quadriga.shared.robots.conventions import Array
from tests.agents.duet import CONFIG, FIRST_PLAN, coupled, every_100_ms, record

ANSWERS = 2
ANSWERING = replace(CONFIG, planner=replace(CONFIG.planner, exchanges=ANSWERS))
GAP = 10  # ms: a quarter of the step for K = 2


def test_every_step_has_its_plan_and_its_answers_each_with_what_it_used() -> None:
    steps = record(Rollout(ANSWERING, coupled(ANSWERING), every_100_ms), 700)
    for name, peer in (("r1", "r2"), ("r2", "r1")):
        made = [
            (step.inputs.state.tick, step.outputs.plan)
            for step in steps[name]
            if step.outputs.plan is not None
        ]
        expected = [
            (40 * k + GAP * e, k, e)
            for k in range(FIRST_PLAN // 40, 700 // 40 + 1)
            for e in range(ANSWERS + 1)
            if 40 * k + GAP * e < 700
        ]
        assert [(tick, plan.step, plan.exchange) for tick, plan in made] == expected
        for _, plan in made:
            assert plan.tick == 40 * plan.step
            asked = plan.step if plan.exchange else plan.step - 1
            assert plan.used == ({} if plan.serial == (8, 0) else {peer: asked})


def test_who_plans_for_the_team_looks_at_its_peers_as_they_are_now(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Windows end at the step itself, of a new plan by its peers' plans, of an answer measured."""
    config = replace(ANSWERING, planner=replace(ANSWERING.planner, cost="team"))
    sent, looked, terms = 0, [], Peers.terms

    def noted(self: Peers, peers: tuple[PeerData, ...], step: int, end: int, base: Array) -> Any:
        looked.append((step, end))
        return terms(self, peers, step, end, base)

    monkeypatch.setattr(Peers, "terms", noted)
    steps = record(Rollout(config, coupled(config, 1.5), every_100_ms), 600)
    for name, peer in (("r1", "r2"), ("r2", "r1")):
        for step in steps[name]:
            plan = step.outputs.plan
            if plan is not None and plan.step > FIRST_PLAN // 40:
                assert plan.status == "solved"
                assert plan.used == {peer: plan.step if plan.exchange else plan.step - 1}
                sent += 1
    assert sent == 2 * 6 * (ANSWERS + 1)
    assert len(looked) >= sent
    assert all(step == end for step, end in looked)


def test_awaited_are_the_peer_s_answers_in_turn() -> None:
    planning = LocalPlanning(ANSWERING, 0, coupled(ANSWERING), lambda: 0)
    due = {tick: planning.expected(tick) for tick in range(360, 400)}
    assert {tick: item for tick, item in due.items() if item != Expected()} == {
        370: Expected((9, 0), 360),
        380: Expected((9, 1), 360),
        390: Expected((9, 2), 360),
    }


def test_a_late_answer_is_skipped_and_not_waited_for() -> None:
    """r2 falls silent for one answer: r1 goes on with what it has, and answers the next one."""
    rollout = Rollout(ANSWERING, coupled(ANSWERING), every_100_ms)
    made: list[tuple[int, int]] = []
    for tick in rollout.ticks(560):
        plan = tick.outputs["r1"].plan
        if plan is not None:
            made.append(plan.serial)
        if tick.tick == 440:  # r2's plan of step 11 is lost on its way
            rollout._plans = tuple(item for item in rollout._plans if item[0] != "r2")
    assert (11, 0) in made
    assert (11, 1) not in made
    assert {(10, 1), (10, 2), (12, 0), (12, 1), (12, 2)} <= set(made)
