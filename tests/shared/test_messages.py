"""Events in a log."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared import codes
from quadriga.shared.messages import Event, format_event, parse_events

PLAIN = st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=60)


@given(st.integers(0, 10**9), st.sampled_from(sorted(codes.EVENTS)), PLAIN)
def test_a_log_gives_back_the_events_that_were_written_into_it(
    tick: int, code: str, detail: str
) -> None:
    events = [Event.of(tick, code, robot, detail) for robot in ("", "r2")]
    log = ["routing at tcp/127.0.0.1:7447\n", *(f"{format_event(event)}\n" for event in events)]
    assert list(parse_events(log)) == events


def test_a_line_tells_what_happened_and_to_whom() -> None:
    event = Event.of(3777, codes.LIES, "r1", "height 0.1 m")
    assert format_event(event) == "3777 ms: lies r1 height 0.1 m"


def test_lines_that_are_no_events_are_left_out() -> None:
    assert not list(parse_events(["12 ms: nonsense r1 x", "x ms: fall r1 x", "fall r1", ""]))
