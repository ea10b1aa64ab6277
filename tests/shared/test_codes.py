"""Programs decide by codes: each is in the table, on the wire and in a log."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared import codes
from quadriga.shared.codec import decode, encode
from quadriga.shared.messages import Event, format_event, parse_events

KINDS = {"start", "terrain", "payload", "push", "bridge", "fall", "fault", "stop"}
PLAIN = st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=60)


def test_every_code_has_a_kind() -> None:
    declared = {v for k, v in vars(codes).items() if k.isupper() and isinstance(v, str)}
    assert declared == codes.EVENTS.keys()
    assert {*codes.EVENTS.values()} == KINDS


def test_the_code_of_a_status_or_reason_stands_before_its_detail() -> None:
    assert codes.with_detail("estop", "fall: a dog") == "estop:fall: a dog"
    assert codes.code_of("estop:fall: a dog") == "estop"
    assert (codes.code_of("solved"), codes.code_of("")) == ("solved", "")


@given(st.integers(0, 10**9), st.sampled_from(sorted(codes.EVENTS)), PLAIN)
def test_a_log_gives_back_the_events_that_were_written_into_it(
    tick: int, code: str, detail: str
) -> None:
    events = [Event.of(tick, code, robot, detail) for robot in ("", "r2")]
    assert [decode(encode(event), Event) for event in events] == events
    lines = ["routing at tcp/127.0.0.1:7447", "12 ms: nonsense r1 x", "x ms: fall r1 x", ""]
    assert list(parse_events([*lines, *map(format_event, events)])) == events
