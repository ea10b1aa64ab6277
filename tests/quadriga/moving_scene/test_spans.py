"""Which moments of a walk are shown from all sides."""

from __future__ import annotations

from quadriga.moving_scene.spans import Span, choose_spans
from quadriga.report.timeline import TimelineEntry
from quadriga.shared.codes import FALL


def entry(tick: int, robot: str, kind: str = FALL) -> TimelineEntry:
    return TimelineEntry(tick, tick, robot, kind, "")


def test_the_second_before_each_fall_and_falls_together_once() -> None:
    timeline = [
        entry(400, "r1"),
        entry(3000, "r2", "push"),
        entry(4000, "r2"),
        entry(4200, "r1"),
        entry(4600, "r3"),
        entry(9000, "r1"),
    ]
    spans = choose_spans(timeline, 0, 9100, 400)
    assert spans == (
        Span(0, 700, "r1 falls at 0.40 s"),
        Span(3000, 4300, "r2, r1 falls at 4.00 s"),
        Span(3600, 4900, "r3 falls at 4.60 s"),
        Span(8000, 9100, "r1 falls at 9.00 s"),
    )


def test_no_more_falls_than_the_largest_team_has_robots() -> None:
    timeline = [entry(1000 * k, f"r{k}") for k in range(1, 13)]
    spans = choose_spans(timeline, 0, 20_000, 400)
    assert [span.title for span in spans] == [f"r{k} falls at {k}.00 s" for k in range(1, 11)]


def test_without_a_fall_some_strides_before_the_last_second() -> None:
    assert choose_spans([entry(50, "r1", "push")], 0, 20_000, 400) == (
        Span(17_400, 19_000, "4 strides"),
    )
    assert choose_spans([], 100, 900, 400) == (Span(100, 900, "4 strides"),), "all of a short one"
    assert choose_spans([], 100, 2000, 400) == (Span(100, 1700, "4 strides"),)
