"""When a team had stopped after a press, by what was heard; what many presses come to. Pure."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np

from quadriga.shared import codes
from quadriga.shared.codec import decode
from quadriga.shared.messages import Event, Status
from quadriga.shared.modes import ESTOP, STAND
from quadriga.shared.runtime.record import record
from quadriga.shared.topics import STATUS, topic_of
from quadriga.tables import NOTHING, Table

_PLANT: Final = ""
_AT_REST: Final = frozenset((codes.ESTOPPED, codes.ROBOT_STOPPED))
_NOTE: Final = """\
From the press, or the last thing heard of a driver who falls silent, until every agent had said
that it commands damped joints and the plant that it damps them; after silence until all robots had
said that they stand. A process that goes before all others hears it; percentiles are linear
between tries."""


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
    heard: Iterable[tuple[int, str, bytes]],
    presses: Sequence[StopPress],
    robots: Sequence[str],
    stands: frozenset[str],
) -> list[float | None]:
    """After each press, ms until the whole team had stopped; None: it did not before the next one.

    Args:
        heard: ns, key and payload of statuses and events, in the order of time.
        presses: in the order of time.
        robots: of the team.
        stands: ways after which robots stand, instead of being damped.
    """
    found: list[dict[str, int]] = [{} for _ in presses]
    begins = [press.at_ns for press in presses]
    for at_ns, key, payload in heard:
        number = bisect_right(begins, at_ns) - 1
        if number < 0:
            continue
        who = _who_has_stopped(key, payload, stands=presses[number].way in stands)
        if who is not None:
            found[number].setdefault(who, at_ns)
    results: list[float | None] = []
    for press, stopped in zip(presses, found, strict=True):
        wanted = {*robots} if press.way in stands else {*robots, _PLANT}
        last = max(stopped.values(), default=0)
        results.append(1e-6 * (last - press.at_ns) if wanted <= stopped.keys() else None)
    return results


def _who_has_stopped(key: str, payload: bytes, *, stands: bool) -> str | None:
    """Robot, or plant, that has stopped as a message says; None: it does not say so."""
    topic, robot = topic_of(key)
    if topic is STATUS:
        rests = decode(payload, Status).mode == (STAND if stands else ESTOP)
        return robot if rests else None
    return _PLANT if decode(payload, Event).code in _AT_REST else None


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
