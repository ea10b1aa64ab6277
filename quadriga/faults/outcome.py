"""What came of a fault, from the recording of the walk; where that ends early, the world tells."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final, NamedTuple

from quadriga.recordings.gaps import missing_ticks
from quadriga.recordings.traces import Traces
from quadriga.shared import codes
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Event, Status
from quadriga.shared.recording.metadata import END
from quadriga.shared.recording.reader import Recording
from quadriga.shared.topics import STATE

_WALKS: Final = "walk"
_STANDS: Final = ("stand", "passive", "estop")  # a robot that walks no more
_ANNOUNCED: Final = (codes.FAULT_BEGINS, codes.FAULT_ENDS)
_SILENT_MS: Final = 300  # without a status, of which one is due every 100 ms
_CLOCK_MS: Final = 500  # by which the walk may be further than the clock that was read last


class Moment(NamedTuple):
    """When a fault came.

    Attributes:
        robot: the robot that the seed has drawn.
        tick: world time, ms; of a process what the clock showed last.
        wall_ns: ns since 1970, of a process; 0 of a component, whose `tick` is exact.
    """

    robot: str
    tick: int
    wall_ns: int = 0


def describe_outcome(
    config: Config, traces: Traces, recording: Recording, moment: Moment, told: Sequence[Event] = ()
) -> dict[str, Any]:
    """The row of a trial.

    `detect_ms` is the time from the fault until an agent no longer walks, or the world announces
    the end of the walk, or any process misses the world; None if nobody ever noticed.
    `stand_ms` is the time until all others stand, or are damped; None if they walked on.
    `recover_ms` is the time until all robots walk again for good: 0 if none stopped, None if one
    has not walked again, or if the recording lacks the end of the walk. `lost` are robots without
    whose commands the walk ended; their agents' last statuses may be of before. `lost_messages`
    counts what the recording lacks of the other robots, in real time also commands that were never
    sent, and the states and commands of all robots that it lacks before the fault because it ends
    too early.

    Args:
        config: of the walk.
        traces: of its recording.
        recording: it.
        moment: of the fault.
        told: what the world itself has logged: a recording may lack the end.
    """
    tick = moment.tick
    if moment.wall_ns:  # by the recorder's clock, which may be what the fault is about
        tick = max(tick, min(tick_at(recording, moment.wall_ns), tick + _CLOCK_MS))
    events = [*traces.events, *told]
    fallen = sorted({e.robot for e in events if e.code == codes.FALL})
    others = [name for name in traces.robots if name != moment.robot]
    recorded_end = next((e for e in reversed(traces.events) if e.kind == "stop"), None)
    end = recorded_end or next((e for e in reversed(events) if e.kind == "stop"), None)
    goes_on = recorded_end is not None and recorded_end.code != codes.COMMAND_LOST
    last = {name: s[-1] for name, s in traces.statuses.items() if s}
    return {
        "robot": moment.robot,
        "tick": tick,
        "mode": config.world.mode,
        "robots": config.team.robots,
        "falls": fallen,
        "falls_of_others": sum(name in fallen for name in others),
        "lost": _lost_robots(traces.robots, end),
        "detect_ms": _first_notice(traces, events, moment, tick),
        "stand_ms": _after(tick, _all_stand(traces.statuses, others, tick)),
        "recover_ms": _after(tick, _all_walk(traces, tick)) if goes_on else None,
        "lost_messages": _count_lost(config, traces, moment),
        "status": {name: f"{s.mode} {s.reason}".strip() for name, s in last.items()},
        "end": "none announced" if end is None else f"{end.code}: {end.detail}",
    }


def moment_at(recording: Recording, robot: str, wall_ns: int) -> Moment:
    """The moment of a fault of which only the recorder's clock is known."""
    return Moment(robot, tick_at(recording, wall_ns), wall_ns)


def tick_at(recording: Recording, wall_ns: int) -> int:
    """World time at a moment of the recorder's clock: the newest state that had arrived."""
    newest = 0
    for entry in recording.entries({STATE.name}):
        if entry.log_time_ns > wall_ns:
            break
        newest = max(newest, entry.tick)
    return newest


def _first_notice(traces: Traces, events: Iterable[Event], moment: Moment, tick: int) -> int | None:
    noticed = [
        status.tick - tick
        for statuses in traces.statuses.values()
        for status in statuses
        if status.tick >= tick and status.mode != _WALKS
    ]
    noticed += [
        event.tick - tick
        for event in events
        if event.tick >= tick
        and event.code not in _ANNOUNCED
        and (event.kind == "fault" or event.code == codes.COMMAND_LOST)
    ]
    missed_ns = int(traces.notes.get(END, {}).get("missed_ns", "0"))
    if moment.wall_ns and missed_ns >= moment.wall_ns:
        noticed.append(round(1e-6 * (missed_ns - moment.wall_ns)))
    return min(noticed, default=None)


def _all_stand(
    statuses: Mapping[str, tuple[Status, ...]], others: list[str], tick: int
) -> int | None:
    """When the last of the others stood that walked at the fault; None if one walked on."""
    ticks = list[int]()
    for name in others:
        still = [s.tick for s in statuses[name] if s.tick >= tick and s.mode in _STANDS]
        if not still:
            return None
        ticks.append(still[0])
    return max(ticks, default=None)


def _all_walk(traces: Traces, tick: int) -> int | None:
    """When the last robot went on for good; the fault's tick if none stopped; None: one did not."""
    newest = max((s[-1].tick for s in traces.statuses.values() if s), default=tick)
    since = [tick]
    for name in traces.robots:
        statuses = [s for s in traces.statuses[name] if s.tick >= tick - _SILENT_MS]
        if not statuses or statuses[-1].mode != _WALKS:
            return None
        if newest - statuses[-1].tick > _SILENT_MS:
            return None
        since += [now.tick for before, now in itertools.pairwise(statuses) if _resumes(before, now)]
    return max(since)


def _resumes(before: Status, now: Status) -> bool:
    return now.mode == _WALKS and before.mode != _WALKS


def _lost_robots(robots: Sequence[str], end: Event | None) -> list[str]:
    """Robots without whose commands the walk ended."""
    if end is None or end.code != codes.COMMAND_LOST:
        return []
    return [name for name in robots if name in re.split(r"[, ]+", end.detail.partition(";")[0])]


def _after(tick: int, later: int | None) -> int | None:
    return None if later is None else later - tick


def _count_lost(config: Config, traces: Traces, moment: Moment) -> int:
    own = STATE.key(config.team.name, moment.robot).removesuffix(STATE.name)
    missing = missing_ticks(config, traces.ticks, traces.statuses)
    lost = sum(count for key, count in missing.items() if not key.startswith(own))
    states = [traces.ticks.get(STATE.key(config.team.name, name)) for name in traces.robots]
    newest = max((int(found.max()) for found in states if found is not None), default=0)
    return lost + 2 * len(traces.robots) * max(0, moment.tick - newest)
