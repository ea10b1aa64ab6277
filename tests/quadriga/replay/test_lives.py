"""An agent that was started again has several lives, and each is replayed by itself."""

from __future__ import annotations

from dataclasses import replace

from quadriga.agents.agent import Agent, Inputs, Outputs
from quadriga.plant.late import damp_joints
from quadriga.replay.agent_log import ALL_TOLD, AgentLog
from quadriga.replay.comparison import Comparison, ReplayedStep
from quadriga.replay.lives import first_tick, split_lives
from quadriga.shared.codec import encode
from quadriga.shared.messages import Command, Consumed
from tests.a1 import standing
from tests.agents.lone_robot import ALONE

AGENT = Agent(ALONE, "r1", None)


def record(tick: int, number: int, passed: int = 0) -> Consumed:
    return Consumed(tick, 0, number, passed, (), ())


def log_of(records: list[Consumed], commands: list[int]) -> AgentLog:
    log = AgentLog()
    for tick in commands:
        log.states[tick].append(b"")
        log.sent["command", tick, 0].append(b"")
    log.records.update({item.tick: item for item in records})
    log.last = max(commands)
    return log


def test_one_process_has_one_life() -> None:
    log = log_of([record(3, 0), record(5, 1, 1)], [0, 1, 2, 3, 5])
    assert split_lives(log, paced=True, whole=True) == (log,)


def test_each_process_counts_what_it_took_in_from_nothing() -> None:
    records = [record(1, 0), record(2, 1), record(900, 0, 900), record(905, 1, 3), record(2000, 0)]
    log = log_of(records, [0, 1, 2, 3, 900, 901, 905, 2000, 2001])
    lives = split_lives(log, paced=True, whole=True)
    assert [first_tick(life) for life in lives] == [0, 900, 2000]
    assert [life.last for life in lives] == [3, 905, 2001]
    assert [sorted(life.records) for life in lives] == [[1, 2], [900, 905], [2000]]
    assert all(life.sent is log.sent for life in lives)


def test_the_first_words_of_a_second_life_may_be_lost() -> None:
    log = log_of([record(1, 0), record(2, 1), record(3, 2), record(900, 1, 4)], [1, 2, 3, 900])
    assert [life.last for life in split_lives(log, paced=True, whole=True)] == [3, 900]


def test_what_a_process_took_in_at_its_last_steps_it_may_not_have_told() -> None:
    records = [record(1, 0), record(2, 1), record(900, 0, 900), record(905, 1, 3)]
    log = log_of(records, [0, 1, 2, 3, 900, 901, 905, 906])
    told = [life.told for life in split_lives(log, paced=True, whole=True)]
    assert told == [2, ALL_TOLD], "the second one lived to see the end"
    assert [life.told for life in split_lives(log, paced=True, whole=False)] == [2, 905]
    assert split_lives(log, paced=False, whole=False)[1].told == ALL_TOLD, "the rules tell"
    log.states[906 + 1001].append(b"")
    assert [life.told for life in split_lives(log, paced=True, whole=True)] == [2, 905]


def test_what_it_sent_then_is_compared_with_nothing() -> None:
    log = AgentLog()
    sent = {tick: damp_joints(tick) for tick in (0, 1, 2, 3, 900)}
    for tick, command in sent.items():
        log.sent["command", tick, 0].append(encode(command))
    first = replace(log, told=1, last=3)
    comparison = Comparison(log)
    for tick in (0, 1):
        comparison.add(step_of(sent[tick]))
    comparison.add(step_of(damp_joints(2, damping=9.0)), told=False)
    comparison.end_life(first)
    comparison.add(step_of(damp_joints(900, damping=9.0)))
    verdict = comparison.finish()
    assert verdict.equal == {"command": 2}
    assert verdict.untold == {"command": 2}, "one that differs, one that there is not"
    assert verdict.differing == {"command": 1}
    assert verdict.first is not None
    assert verdict.first.tick == 900


def step_of(command: Command) -> ReplayedStep:
    outputs = Outputs(command, None, None, "walk", "", {}, {}, None)
    return ReplayedStep(AGENT.initial(), Inputs(standing(command.tick)), outputs)
