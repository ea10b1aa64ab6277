"""Which moments of a walk its page shows from all sides. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from quadriga.report.timeline import TimelineEntry
from quadriga.shared.codes import FALL
from quadriga.shared.runtime.record import record

_BEFORE_MS, _AFTER_MS = 1000, 300  # of a fall
_MOST: Final = 10  # falls that are shown, one of each robot of the largest team
_TOGETHER_MS: Final = 300  # falls so near to each other are one
_STRIDES: Final = 4
_LAST_STEPS_MS: Final = 1000  # before the end of a walk, which may be out of the ordinary


@record
class Span:
    """From one tick to another, and what is to be seen there."""

    first: int
    last: int
    title: str


def choose_spans(
    timeline: Iterable[TimelineEntry], begin: int, end: int, stride_ms: int
) -> tuple[Span, ...]:
    """The second before each fall; of a walk without one some strides, shortly before its end.

    Args:
        timeline: of the walk, by time.
        begin: first tick of it.
        end: last tick of it.
        stride_ms: how long a stride takes.
    """
    falls: list[tuple[int, list[str]]] = []
    for entry in timeline:
        if entry.kind != FALL:
            continue
        if falls and entry.tick - falls[-1][0] <= _TOGETHER_MS:
            falls[-1][1].append(entry.robot)
        else:
            falls.append((entry.tick, [entry.robot]))
    spans = [
        Span(tick - _BEFORE_MS, tick + _AFTER_MS, f"{', '.join(who)} falls at {tick / 1000:.2f} s")
        for tick, who in falls[:_MOST]
    ]
    if not spans:
        last = max(end - _LAST_STEPS_MS, min(end, begin + _STRIDES * stride_ms))
        spans = [Span(last - _STRIDES * stride_ms, last, f"{_STRIDES} strides")]
    return tuple(Span(max(s.first, begin), min(s.last, end), s.title) for s in spans)
