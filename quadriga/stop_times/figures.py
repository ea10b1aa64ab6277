"""When a team had stopped after a press, by recording and clock; what many come to. Pure."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np

from quadriga.agents.modes import STAND
from quadriga.shared.recording.mcap_chunk import ChunkEntry
from quadriga.shared.runtime.record import record
from quadriga.shared.wire import codes
from quadriga.shared.wire.codec import decode
from quadriga.shared.wire.messages import Command, Event, Status
from quadriga.shared.wire.topics import COMMAND, EVENT, STATUS, topic_of
from quadriga.stop_times.tick_times import TickTimes
from quadriga.tables import NOTHING, Table

TOPICS: Final = frozenset((COMMAND.name, EVENT.name, STATUS.name))  # that `find_stops` looks at
_PLANT: Final = ""
_AT_REST: Final = frozenset((codes.ESTOPPED, codes.ROBOT_STOPPED))
_NOTE: Final = """\
From the press, or the last thing heard of a driver who falls silent, until the tick at which the
plant damps all joints by itself and every agent commands that they be damped, whichever is later;
after silence until all robots stand. A tick's time is when a process that goes before all others
hears the team's clock, every 10 ms; percentiles are linear between tries."""


@record
class StopPress:
    """One try to stop a team.

    Attributes:
        way: in which it was stopped.
        at_ns: of `monotonic_ns`, at the press.
    """

    way: str
    at_ns: int


def find_stops(
    entries: Iterable[ChunkEntry],
    times: TickTimes,
    presses: Sequence[StopPress],
    robots: Sequence[str],
    stands: frozenset[str],
) -> list[float | None]:
    """After each press, ms until the whole team had stopped; None: it did not before the next one.

    Args:
        entries: of the recording; topics other than `TOPICS` are of no use.
        times: of the ticks that the messages are of.
        presses: in the order of time.
        robots: of the team.
        stands: ways after which robots stand, instead of being damped.
    """
    found: list[dict[str, int]] = [{} for _ in presses]
    begins = [press.at_ns for press in presses]
    for entry in entries:
        at = times.latest(entry.tick)
        number = -1 if at is None else bisect_right(begins, at) - 1
        if at is None or number < 0:
            continue
        who = _who_has_stopped(entry, stands=presses[number].way in stands)
        if who is not None:
            found[number][who] = min(at, found[number].get(who, at))
    results: list[float | None] = []
    for press, stopped in zip(presses, found, strict=True):
        wanted = {*robots} if press.way in stands else {*robots, _PLANT}
        last = max(stopped.values(), default=0)
        results.append(1e-6 * (last - press.at_ns) if wanted <= stopped.keys() else None)
    return results


def _who_has_stopped(entry: ChunkEntry, *, stands: bool) -> str | None:
    """Robot, or plant, that has stopped as a message says; None: it does not say so."""
    topic, robot = topic_of(entry.key)
    if stands:
        rests = topic is STATUS and decode(entry.payload, Status).mode == STAND
        return robot if rests else None
    if topic is COMMAND:
        command = decode(entry.payload, Command)
        return None if command.kp.any() or command.tau.any() else robot
    if topic is EVENT and decode(entry.payload, Event).code in _AT_REST:
        return _PLANT
    return None


def sum_up(tries: Mapping[str, Sequence[float | None]]) -> dict[str, dict[str, Any]]:
    """For each way: tries, how many of them stopped the team, and after how many ms."""
    return {way: _figures(values) for way, values in tries.items()}


def _figures(values: Sequence[float | None]) -> dict[str, Any]:
    known = [value for value in values if value is not None]
    p50, p99 = np.percentile(known, (50, 99)).round(1).tolist() if known else (None, None)
    most = round(max(known), 1) if known else None
    return {
        "tries": len(values),
        "stopped": len(known),
        "p50_ms": p50,
        "p99_ms": p99,
        "max_ms": most,
    }


def build_stop_table(figures: Mapping[str, Mapping[str, Any]]) -> Table:
    """A line for each way."""
    names = ("tries", "stopped", "p50_ms", "p99_ms", "max_ms")
    rows = tuple(
        (way, *(NOTHING if row[name] is None else f"{row[name]:g}" for name in names))
        for way, row in figures.items()
    )
    columns = ("way", *(name.replace("_", " ") for name in names))
    return Table("From a press until the team had stopped", columns, rows, [_NOTE])
