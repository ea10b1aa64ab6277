"""An agent that was started again has several lives, and each is replayed by itself."""

from __future__ import annotations

from quadriga.replay.agent_log import AgentLog
from quadriga.replay.lives import first_tick, split_lives
from quadriga.shared.wire.messages import Consumed


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
    assert split_lives(log) == (log,)


def test_each_process_counts_what_it_took_in_from_nothing() -> None:
    records = [record(1, 0), record(2, 1), record(900, 0, 900), record(905, 1, 3), record(2000, 0)]
    log = log_of(records, [0, 1, 2, 3, 900, 901, 905, 2000, 2001])
    lives = split_lives(log)
    assert [first_tick(life) for life in lives] == [0, 900, 2000]
    assert [life.last for life in lives] == [3, 905, 2001]
    assert [sorted(life.records) for life in lives] == [[1, 2], [900, 905], [2000]]
    assert all(life.sent is log.sent for life in lives)


def test_the_first_words_of_a_second_life_may_be_lost() -> None:
    log = log_of([record(1, 0), record(2, 1), record(3, 2), record(900, 1, 4)], [1, 2, 3, 900])
    assert [life.last for life in split_lives(log)] == [3, 900]
