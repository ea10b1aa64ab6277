"""A robot does not walk while another one of its team does not, whatever its planner takes in."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.agents.agent import Agent, Inputs, Outputs
from quadriga.agents.teammates import (
    GRACE_MS,
    SILENCE_MS,
    Teammates,
    TeamWatch,
    concerns_agents,
    has_operator,
)
from quadriga.shared.codes import BACK, GONE, LOWERED, OPERATOR_BACK, OPERATOR_GONE, PUSH, SILENT
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Event, Reference, Status
from tests.a1 import standing

KEYS = {"team.robots": 3, "planner.kind": "none"}
REAL = load(None, {**KEYS, "world.mode": "realtime"})
STEPS = load(None, KEYS)
WATCH = TeamWatch(REAL, "r1")
NOW, SINCE = 9000, 300  # tick; when r1 began to walk


def status(tick: int, mode: str, reason: str = "") -> Status:
    return Status(tick, 0, mode, reason, "", {}, {}, np.zeros(0), np.zeros(0))


def known(*events: Event, **statuses: Status) -> Teammates:
    return WATCH.remember(Teammates(), statuses.items(), events)


def walking(tick: int = NOW) -> dict[str, Status]:
    return {"r2": status(tick, "walk"), "r3": status(tick, "walk")}


@pytest.mark.parametrize(
    ("said", "lost"),
    [
        (status(NOW - 90, "walk"), False),
        (status(NOW - SILENCE_MS, "walk"), False),
        (status(NOW - SILENCE_MS - 1, "walk"), True),
        (status(NOW - 90, "stand", "reference-lost"), True),
        (status(NOW - 90, "stopping", "peer-lost:r3"), True),
        (status(NOW - 90, "stand"), False),  # all stand before they walk
        (status(NOW - 90, "damping", "fall"), True),
        (status(NOW - 90, "estop", "estop:dog"), True),
        (status(NOW - 90, "rising", "led-down"), True),
    ],
)
def test_whose_own_words_stop_the_others(said: Status, lost: bool) -> None:
    found = WATCH.find_lost(known(**{**walking(), "r2": said}), NOW, SINCE)
    assert found == (("r2",) if lost else ())


def test_robots_that_walk_again_need_not_begin_at_once() -> None:
    team = known(**{**walking(), "r2": status(NOW, "stand", "peer-lost:r3")})
    assert WATCH.find_lost(team, NOW, NOW - GRACE_MS) == ()
    assert WATCH.find_lost(team, NOW, NOW - GRACE_MS - 1) == ("r2",)
    damped = known(**{**walking(), "r2": status(NOW, "damping", "fall")})
    assert WATCH.find_lost(damped, NOW, NOW - 1) == ("r2",)


@pytest.mark.parametrize("code", [GONE, SILENT])
def test_whom_the_plant_calls_lost_is_until_it_answers_again(code: str) -> None:
    gone = Event.of(NOW, code, "r2", "gone")
    assert WATCH.find_lost(known(gone, **walking()), NOW, SINCE) == ("r2",)
    back = Event.of(NOW + 5, BACK, "r2", "answers again")
    assert WATCH.find_lost(known(gone, back, **walking()), NOW, SINCE) == ()
    later = walking(NOW + GRACE_MS + 1)  # nobody has heard that it is back
    assert WATCH.find_lost(known(gone, **later), NOW + GRACE_MS + 1, SINCE) == ()
    assert concerns_agents(gone)
    assert concerns_agents(back)
    assert not concerns_agents(Event.of(NOW, PUSH, "r2", ""))
    lowered = Event.of(NOW, LOWERED, "r2", "")
    assert known(lowered, **walking()) == known(**walking()), "its own affair"


def test_who_is_led_down_is_told_so_by_the_plant() -> None:
    told, of_another = (Event.of(NOW, LOWERED, name, "led down") for name in ("r1", "r2"))
    assert concerns_agents(told)
    assert WATCH.is_led_down((of_another, told))
    assert not WATCH.is_led_down((of_another, Event.of(NOW, SILENT, "r1", "late")))


def test_there_is_no_operator_from_the_plants_word_until_its_return_is_told_or_seen() -> None:
    gone = Event.of(NOW, OPERATOR_GONE, "", "gone")
    back = Event.of(NOW + 5, OPERATOR_BACK, "", "there again")
    old, new = (Reference(NOW + GRACE_MS + k, 0, 0.2, 0.0, 0.0, 0.26) for k in (0, 1))
    assert has_operator(known(), ())
    assert not has_operator(known(gone), ())
    assert not has_operator(known(gone), (old,)), "said before it left, of the near future"
    assert has_operator(known(gone), (old, new)), "nobody has heard that it is back"
    assert has_operator(known(gone, back), (old,))
    assert WATCH.find_lost(known(gone, **walking()), NOW, SINCE) == ()
    assert concerns_agents(gone)
    assert concerns_agents(back)


@pytest.mark.parametrize("code", [GONE, SILENT, LOWERED])
def test_of_itself_a_robot_is_told_whether_its_commands_are_followed(code: str) -> None:
    lost, back = Event.of(NOW, code, "r1", "lost"), Event.of(NOW + 1, BACK, "r1", "answers again")
    assert known(lost) == Teammates(unheeded=True)
    assert known(lost, back) == Teammates()


def test_all_are_ready_once_each_has_said_so() -> None:
    stands = status(NOW, "stand", "led-down")
    assert WATCH.are_ready(known(r2=stands, r3=status(NOW, "walk")), NOW)
    assert not WATCH.are_ready(known(r2=stands), NOW), "r3 has not spoken"
    for other in ("rising", "stopping", "damping"):
        assert not WATCH.are_ready(known(r2=stands, r3=status(NOW, other, "led-down")), NOW)
    assert not WATCH.are_ready(known(r2=stands, r3=status(NOW, "stand", "balance-lost")), NOW)
    assert not WATCH.are_ready(known(r2=stands, r3=status(NOW, "stand")), NOW + SILENCE_MS + 1)
    gone = Event.of(NOW, GONE, "r3", "gone")
    assert not WATCH.are_ready(known(gone, r2=stands, r3=stands), NOW)
    steps = TeamWatch(STEPS, "r1")
    assert steps.are_ready(Teammates(), NOW), "in lock-step the plant alone tells"
    assert not steps.are_ready(known(gone), NOW)


def test_a_robot_gets_up_once_the_others_are_still() -> None:
    back = NOW - 50
    assert not WATCH.are_still(known(**walking()), NOW, back)
    still = {"r2": status(NOW, "stand", "peer-lost:r1"), "r3": status(NOW, "rising", "led-down")}
    assert WATCH.are_still(known(**still), NOW, back)
    assert not WATCH.are_still(known(r2=still["r2"]), NOW, back), "r3 may still speak"
    assert WATCH.are_still(known(r2=still["r2"]), back + GRACE_MS + 1, back)


@pytest.mark.parametrize("config", [REAL, STEPS], ids=["realtime", "lockstep"])
def test_an_agent_that_plans_nothing_stops_for_a_lost_robot_all_the_same(config: Config) -> None:
    agent = Agent(config, "r1", None)
    memory, seen = agent.initial(), dict[int, Outputs]()
    for tick in range(1400):
        reference = Reference(tick, 0, 0.2, 0.0, 0.0, 0.26)
        references = (reference,) if tick % 100 == 0 else ()
        gone = (Event.of(500, GONE, "r2", "gone"),) if tick == 501 else ()
        inputs = Inputs(standing(tick), references=references, events=gone)
        memory, seen[tick] = agent.step(memory, inputs)
    assert (seen[500].mode, seen[501].mode) == ("walk", "stopping")
    assert seen[501].reason == "peer-lost:r2"
    assert seen[1399].mode == "stand"
