"""What happened when: the world's events, the agents' modes and plans, gaps in the recording."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Final

import numpy as np

from quadriga.agents.planner.solver import SOLVED
from quadriga.recordings.traces import Traces
from quadriga.recordings.truth import Ticks
from quadriga.shared.codes import FALL, code_of
from quadriga.shared.config.timing import periods
from quadriga.shared.messages import Plan, Status
from quadriga.shared.modes import ESTOP, PASSIVE, STAND, WALK
from quadriga.shared.topics import MEASUREMENT, STATE, TRUTH

FAULT: Final = "fault"
STOP: Final = "stopped"
_TROUBLE: Final = (FALL, FAULT, STOP)
# Counted while all is well: the whole-body QP at a limit, and what the plans themselves report.
_USUAL: Final = ("qp_constrained", "plan_")
_LULL_MS: Final = 500  # what is counted again after less than this belongs together
_GAP_PERIODS: Final = 5  # missing messages in a row that are a gap


@dataclass(frozen=True, slots=True)
class TimelineEntry:
    """Something that happened.

    Attributes:
        tick: when, ms.
        stop: until when, ms; the same tick if it did not last.
        robot: whom it concerns, or empty.
        kind: of an event of the world, or stopped, mode, plan, counted, gap.
        text: what it was.
        code: of an event, a plan's status or a reason to stop (`quadriga.shared.codes`).
        passive: whether the robot's joints were only damped from then on.
    """

    tick: int
    stop: int
    robot: str
    kind: str
    text: str
    code: str = ""
    passive: bool = False

    @property
    def trouble(self) -> bool:
        """Whether it asks for an explanation."""
        return self.kind in _TROUBLE


def build_timeline(traces: Traces, begin: int, end: int) -> tuple[TimelineEntry, ...]:
    """All entries of a run, by time."""
    entries = [
        TimelineEntry(e.tick, e.tick, e.robot, e.kind, e.detail, e.code, passive=e.code == FALL)
        for e in traces.events
        if e.tick <= end
    ]
    fallen = {event.robot for event in traces.events if event.code == FALL}
    for robot, statuses in traces.statuses.items():
        entries += [entry for entry in _find_falls(robot, statuses) if robot not in fallen][:1]
        entries += _find_mode_changes(robot, [s for s in statuses if s.tick <= end])
        entries += _find_counts(robot, [s for s in statuses if s.tick <= end])
    for robot, plans in traces.plans.items():
        entries += _find_failed_plans(robot, [p for p in plans if p.tick <= end], end)
    entries += _find_gaps(traces, end)
    if begin > 0:
        entries.append(TimelineEntry(begin, begin, "", "recording", "the recording begins here"))
    if traces.cut:
        entries.append(TimelineEntry(end, end, "", "recording", traces.cut))
    return tuple(sorted(entries, key=lambda e: (e.tick, e.kind != FALL, e.robot, e.text)))


def _find_falls(robot: str, statuses: Sequence[Status]) -> Iterator[TimelineEntry]:
    """Falls that the robot itself reports, for recordings without a world that does."""
    for status in statuses:
        if code_of(status.reason) == FALL:
            tick, text = status.tick, "by its own word"
            yield TimelineEntry(tick, tick, robot, FALL, text, FALL, passive=True)


def _find_mode_changes(robot: str, statuses: Sequence[Status]) -> Iterator[TimelineEntry]:
    before = ("", "")
    for status in statuses:
        now = (status.mode, status.reason)
        if now == before:
            continue
        if status.reason and status.reason != before[1]:
            text = f"{status.reason} ({status.mode})"
            code, passive = code_of(status.reason), status.mode in (PASSIVE, ESTOP)
            tick = status.tick
            yield TimelineEntry(tick, tick, robot, STOP, text, code, passive=passive)
        elif before[0] and status.mode not in (WALK, before[0]):
            yield TimelineEntry(status.tick, status.tick, robot, "mode", status.mode)
        elif before[0] == STAND and status.mode == WALK:
            yield TimelineEntry(status.tick, status.tick, robot, "mode", "begins to walk")
        before = now


def _find_counts(robot: str, statuses: Sequence[Status]) -> Iterator[TimelineEntry]:
    """Counters that rose, by name; rises that follow each other closely are one entry."""
    names = {name for status in statuses for name in status.counters}
    for name in sorted(name for name in names if not name.startswith(_USUAL)):
        counts = [(status.tick, int(status.counters.get(name, 0))) for status in statuses]
        rises = [
            (tick, count - before)
            for (_, before), (tick, count) in zip([(0, 0), *counts], counts, strict=False)
            if count > before
        ]
        for group in _group([tick for tick, _ in rises]):
            total = sum(rises[k][1] for k in group)
            first, last = rises[group[0]][0], rises[group[-1]][0]
            yield TimelineEntry(first, last, robot, "counted", f"{name} {total:,}")


def _find_failed_plans(robot: str, plans: Sequence[Plan], end: int) -> Iterator[TimelineEntry]:
    """Spells of plans that are not simply solved."""
    first = 0
    for k, plan in enumerate(plans):
        following = plans[k + 1] if k + 1 < len(plans) else None
        if following is not None and following.status == plan.status:
            continue
        begin, stop = plans[first].tick, following.tick if following else plan.tick
        count, first = k + 1 - first, k + 1
        if plan.status != SOLVED:
            many = f"{count} plans" if count > 1 else "1 plan"
            text, code = f"{plan.status}, {many}", code_of(plan.status)
            yield TimelineEntry(begin, min(stop, end), robot, "plan", text, code)


def _find_gaps(traces: Traces, end: int) -> Iterator[TimelineEntry]:
    """Stretches for which nothing of a topic with a fixed rate was recorded."""
    team, every = traces.config.team.name, periods(traces.config)
    wanted = [(TRUTH, ""), *product((STATE, MEASUREMENT), traces.robots)]
    for topic, robot in wanted:
        key, period = topic.key(team, robot), every[topic.name]
        ticks: Ticks = np.unique(traces.ticks.get(key, np.zeros(0, dtype=np.int64)))
        ticks = ticks[ticks <= end]
        for k in np.flatnonzero(np.diff(ticks) > _GAP_PERIODS * period).tolist():
            missing = (int(ticks[k + 1]) - int(ticks[k])) // period - 1
            name = key.partition("/")[2]
            text = f"{missing:,} messages of {name} are missing"
            yield TimelineEntry(int(ticks[k]) + period, int(ticks[k + 1]), robot, "gap", text)


def _group(ticks: Sequence[int]) -> list[list[int]]:
    """Indices of ticks, in groups that no lull separates."""
    groups: list[list[int]] = []
    for k, tick in enumerate(ticks):
        if groups and tick - ticks[groups[-1][-1]] <= _LULL_MS:
            groups[-1].append(k)
        else:
            groups.append([k])
    return groups
