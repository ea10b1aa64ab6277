"""Which ticks a recording lacks of what its team should have sent.

`TickTrack` counts what is missing between the messages of a key as they come. Here the expectation
is the team's: a robot of which nothing was recorded lacks everything.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Final

import numpy as np

from quadriga.recordings.truth import Ticks
from quadriga.shared.config.sections import Config
from quadriga.shared.config.timing import periods
from quadriga.shared.messages import Status
from quadriga.shared.modes import STANDING_UP, WALK
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.topics import COMMAND, MEASUREMENT, PLAN, SAMPLE_MS, STATE, TRUTH, Topic

Span = tuple[float, float]  # ticks from the first up to before the second

_UNKNOWN: Final[Mapping[str, Sequence[Status]]] = MappingProxyType({})
_ALWAYS: Final = ((0.0, math.inf),)

_NONE_PASSED: Final[Mapping[str, Sequence[Span]]] = MappingProxyType({})


def missing_ticks(
    config: Config,
    ticks: Mapping[str, Ticks],
    statuses: Mapping[str, Sequence[Status]] = _UNKNOWN,
    passed_over: Mapping[str, Sequence[Span]] = _NONE_PASSED,
) -> dict[str, int]:
    """Number of missing ticks by key.

    Each topic is expected once a period. A state, a command and truth, of a plant that knows it,
    are expected from tick 0 on, measurements from their first on, up to the team's last state; of a
    topic's last period nothing is expected, since the world may have stopped within it. A robot
    that gets up measures nothing, and one that does not walk plans nothing: where its statuses say
    so, nothing is expected until it has begun again. After its last plan none is. A robot without
    measurements or plans lacks all from the end of the initial stand on; of a controller of one's
    own no measurements are expected. Of ticks that an agent, late in real time, says it passed
    over no command is, of samples that ended in them or fell into them no measurement, and of
    windows that lack such a sample no plan.

    Args:
        config: the configuration of the run.
        ticks: recorded ticks by key.
        statuses: of each robot, if they are known.
        passed_over: ticks that each robot's agent says it passed over.
    """
    team, names = config.team.name, robot_names(config.team.robots)
    period = periods(config)
    states = [_recorded_ticks(ticks, STATE.key(team, name)) for name in names]
    newest = max((int(of_robot.max()) for of_robot in states if len(of_robot)), default=-1)
    # No later than the configured end: a forged tick must not ask for years of messages.
    end = min(newest, end_of_world(config))

    def absent(key: str, topic: Topic) -> Ticks:
        return _find_missing(_recorded_ticks(ticks, key), 0, period[topic.name], end)

    missing = dict[str, int]()
    if config.team.one_world:
        missing[TRUTH.key(team)] = len(absent(TRUTH.key(team), TRUTH))
    for name in names:
        missing[STATE.key(team, name)] = len(absent(STATE.key(team, name), STATE))
        passed = passed_over.get(name, ())
        unanswered = absent(key := COMMAND.key(team, name), COMMAND)
        missing[key] = _count_outside(unanswered, passed)
        said = statuses.get(name, ())
        missing |= _missing_of_walk(config, name, ticks, said, _without_sample(passed), end)
    return dict(sorted(missing.items()))


def _missing_of_walk(
    config: Config,
    name: str,
    ticks: Mapping[str, Ticks],
    statuses: Sequence[Status],
    unsampled: Sequence[Span],
    end: int,
) -> dict[str, int]:
    """Missing measurements and plans of a robot by key, see `missing_ticks`.

    Args:
        config: the configuration of the run.
        name: the robot's.
        ticks: recorded ticks by key.
        statuses: the robot's.
        unsampled: when no sample is made.
        end: the last tick at which something is expected.
    """
    team, stand_ms, missing = config.team.name, config.gait.stand_ms, dict[str, int]()
    if not config.team.agent_command:
        spans = _find_spans(statuses, lambda mode: mode != STANDING_UP)
        found = _recorded_ticks(ticks, key := MEASUREMENT.key(team, name))
        missing[key] = _count_missing_within(spans, found, stand_ms, SAMPLE_MS, end, unsampled)
    if find_kind(config.planner.kind).publishes:
        spans = _find_spans(statuses, lambda mode: mode == WALK)
        found = _recorded_ticks(ticks, key := PLAN.key(team, name))
        period, last = periods(config)[PLAN.name], min(int(found.max()), end) if len(found) else end
        unplanned = _without_window(unsampled, config.planner.T_ini)
        missing[key] = _count_missing_within(spans, found, stand_ms, period, last, unplanned)
    return missing


def end_of_world(config: Config) -> int:
    """The last tick a run of `config` can have, ms."""
    return round(1000 * config.world.duration)


def repeated_ticks(ticks: Mapping[str, Ticks]) -> int:
    """Number of states and commands whose key and tick had been seen before: a second publisher."""
    names = (f"/{STATE.name}", f"/{COMMAND.name}")
    return sum(
        len(of_key) - len(np.unique(of_key)) for key, of_key in ticks.items() if key.endswith(names)
    )


def _find_spans(statuses: Iterable[Status], holds: Callable[[str], bool]) -> tuple[Span, ...]:
    """When a robot was in a mode of which `holds` is true; always, if it never said its mode."""
    spans, begun, said = list[Span](), math.inf, False
    for status in sorted(statuses, key=lambda each: each.tick):
        if holds(status.mode):
            begun = min(begun, status.tick) if said else 0.0
        elif begun < math.inf:
            spans.append((begun, status.tick))
            begun = math.inf
        said = True
    if begun < math.inf:
        spans.append((begun, math.inf))
    return tuple(spans) if said else _ALWAYS


def _without_sample(passed_over: Iterable[Span]) -> tuple[Span, ...]:
    """When no sample is made: its last tick was passed over, or all of it before that."""
    return tuple((a, b + 1 if b - a >= SAMPLE_MS else b) for a, b in passed_over)


def _without_window(unsampled: Iterable[Span], T_ini: int) -> tuple[Span, ...]:
    """When no plan is made: one of the last T_ini samples was not."""
    spans = []
    for a, b in unsampled:
        first, last = (SAMPLE_MS * math.floor(x / SAMPLE_MS) for x in (a + SAMPLE_MS - 1, b - 1))
        if first <= last:
            spans.append((first, last + SAMPLE_MS * (T_ini - 1) + 1))
    return tuple(spans)


def _count_missing_within(
    spans: Iterable[Span],
    recorded: Ticks,
    first: int,
    period: int,
    last: int,
    unmade: Sequence[Span],
) -> int:
    """Ticks that were not found and are not in `unmade`, in each span from the first found on.

    If none was found at all, those from `first` on are expected.
    """
    missing = 0
    for begin, end in spans:
        found = recorded[(recorded >= begin) & (recorded < end)]
        if len(found) or not len(recorded):
            begun = int(found.min()) if len(found) else max(first, int(begin))
            absent = _find_missing(found, begun, period, int(min(end, last)))
            missing += _count_outside(absent, unmade)
    return missing


def _find_missing(recorded: Ticks, first: int, period: int, last: int) -> Ticks:
    """Ticks of `first`, `first + period`, … up to `last − period` that were not found."""
    expected = np.arange(first, last - period + 1, period)
    return expected[np.isin(expected, recorded, invert=True)]


def _count_outside(ticks: Ticks, spans: Sequence[Span]) -> int:
    """How many of some ticks are within no span."""
    if not spans:
        return len(ticks)
    begins, ends = np.array(sorted(spans)).T
    latest = np.maximum.accumulate(ends)  # of all that begin no later
    place = np.searchsorted(begins, ticks, side="right") - 1
    return int(((place < 0) | (ticks >= latest[place])).sum())


def _recorded_ticks(ticks: Mapping[str, Ticks], key: str) -> Ticks:
    return ticks.get(key, np.zeros(0, dtype=np.int64))
