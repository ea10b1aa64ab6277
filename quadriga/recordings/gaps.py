"""Which ticks a recording lacks, for every topic with a fixed rate."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from quadriga.recordings.truth import Ticks
from quadriga.shared.config.sections import Config
from quadriga.shared.robot.a1 import robot_names
from quadriga.shared.wire.topics import COMMAND, MEASUREMENT, PLAN, SAMPLE_MS, STATE, TRUTH, Topic


def missing_ticks(config: Config, ticks: Mapping[str, Ticks]) -> dict[str, int]:
    """Number of missing ticks by key.

    A state and a command are expected every 1 ms and truth every 10 ms from tick 0 on,
    measurements every 10 ms from their first on, up to the team's last state; of a topic's last
    period nothing is expected, since the world may have stopped within it. Plans are expected
    every 10 ms · `planner.applied` from their first to their last: a robot that has stopped plans
    no more. A robot without measurements or plans lacks all from the end of the initial stand on.

    Args:
        config: the configuration of the run.
        ticks: recorded ticks by key.
    """
    team = config.team.name
    names = robot_names(config.team.robots)
    states = [_found(ticks, STATE.key(team, name)) for name in names]
    # No later than the configured end: a forged tick must not ask for years of messages.
    last = min(max((int(f.max()) for f in states if len(f)), default=-1), end_of_world(config))
    step = SAMPLE_MS * config.planner.applied
    gaps = {TRUTH.key(team): _missing(_found(ticks, TRUTH.key(team)), 0, SAMPLE_MS, last)}
    for name in names:
        for topic in (STATE, COMMAND):
            gaps[topic.key(team, name)] = _missing(_found(ticks, topic.key(team, name)), 0, 1, last)
        key = MEASUREMENT.key(team, name)
        gaps[key] = _missing(_found(ticks, key), _first(config, ticks, key), SAMPLE_MS, last)
        if config.planner.kind != "none":
            key = PLAN.key(team, name)
            found = _found(ticks, key)
            end = min(int(found.max()), last) if len(found) else last
            gaps[key] = _missing(found, _first(config, ticks, key), step, end)
    return dict(sorted(gaps.items()))


def end_of_world(config: Config) -> int:
    """The last tick a run of `config` can have, ms."""
    return round(1000 * config.world.seconds)


def repeated_ticks(ticks: Mapping[str, Ticks], topics: tuple[Topic, ...] = (STATE, COMMAND)) -> int:
    """Number of messages whose key and tick had been seen before: a second publisher."""
    names = tuple(f"/{topic.name}" for topic in topics)
    return sum(len(f) - len(np.unique(f)) for key, f in ticks.items() if key.endswith(names))


def _first(config: Config, ticks: Mapping[str, Ticks], key: str) -> int:
    found = _found(ticks, key)
    return int(found.min()) if len(found) else config.gait.stand_ms


def _missing(found: Ticks, first: int, period: int, last: int) -> int:
    """Ticks of `first`, `first + period`, … up to `last − period` that were not found."""
    expected = np.arange(first, last - period + 1, period)
    return int(np.isin(expected, found, invert=True).sum())


def _found(ticks: Mapping[str, Ticks], key: str) -> Ticks:
    return ticks.get(key, np.zeros(0, dtype=np.int64))
