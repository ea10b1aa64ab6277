"""Which ticks a recording lacks of what its team should have sent.

`TickTrack` counts what is missing between the messages of a key as they come. Here the expectation
is the team's: a robot of which nothing was recorded lacks everything.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from quadriga.recordings.truth import Ticks
from quadriga.shared.config.sections import Config
from quadriga.shared.config.timing import periods
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.robot.conventions import robot_names
from quadriga.shared.wire.topics import COMMAND, MEASUREMENT, PLAN, STATE, TRUTH, Topic


def missing_ticks(config: Config, ticks: Mapping[str, Ticks]) -> dict[str, int]:
    """Number of missing ticks by key.

    Each topic is expected once a period. A state, a command and truth, of a plant that knows it,
    are expected from tick 0 on,
    measurements from their first on, up to the team's last state; of a topic's last period nothing
    is expected, since the world may have stopped within it. Plans are expected from their first to
    their last: a robot that has stopped plans no more. A robot without measurements or plans lacks
    all from the end of the initial stand on.

    Args:
        config: the configuration of the run.
        ticks: recorded ticks by key.
    """
    team, names = config.team.name, robot_names(config.team.robots)
    period = periods(config)
    states = [_recorded_ticks(ticks, STATE.key(team, name)) for name in names]
    newest = max((int(of_robot.max()) for of_robot in states if len(of_robot)), default=-1)
    # No later than the configured end: a forged tick must not ask for years of messages.
    end = min(newest, end_of_world(config))

    def count(key: str, topic: Topic, first: int, last: int) -> int:
        return _count_missing(_recorded_ticks(ticks, key), first, period[topic.name], last)

    missing = dict[str, int]()
    if config.team.one_world:
        missing[TRUTH.key(team)] = count(TRUTH.key(team), TRUTH, 0, end)
    for name in names:
        for topic in (STATE, COMMAND):
            key = topic.key(team, name)
            missing[key] = count(key, topic, 0, end)
        key = MEASUREMENT.key(team, name)
        missing[key] = count(key, MEASUREMENT, _first_tick(config, ticks, key), end)
        if find_kind(config.planner.kind).publishes:
            key = PLAN.key(team, name)
            plans = _recorded_ticks(ticks, key)
            last = min(int(plans.max()), end) if len(plans) else end
            missing[key] = count(key, PLAN, _first_tick(config, ticks, key), last)
    return dict(sorted(missing.items()))


def end_of_world(config: Config) -> int:
    """The last tick a run of `config` can have, ms."""
    return round(1000 * config.world.seconds)


def repeated_ticks(ticks: Mapping[str, Ticks]) -> int:
    """Number of states and commands whose key and tick had been seen before: a second publisher."""
    names = (f"/{STATE.name}", f"/{COMMAND.name}")
    return sum(
        len(of_key) - len(np.unique(of_key)) for key, of_key in ticks.items() if key.endswith(names)
    )


def _first_tick(config: Config, ticks: Mapping[str, Ticks], key: str) -> int:
    recorded = _recorded_ticks(ticks, key)
    return int(recorded.min()) if len(recorded) else config.gait.stand_ms


def _count_missing(recorded: Ticks, first: int, period: int, last: int) -> int:
    """Ticks of `first`, `first + period`, … up to `last − period` that were not found."""
    expected = np.arange(first, last - period + 1, period)
    return int(np.isin(expected, recorded, invert=True).sum())


def _recorded_ticks(ticks: Mapping[str, Ticks], key: str) -> Ticks:
    return ticks.get(key, np.zeros(0, dtype=np.int64))
