"""Programs decide by codes: each is in the table, and old events get the one they would have."""

from __future__ import annotations

from typing import Any

import msgpack
import pytest

from quadriga.shared.errors import MessageError
from quadriga.shared.wire import codes
from quadriga.shared.wire.codec import decode, encode
from quadriga.shared.wire.messages import Event

KINDS = {"start", "terrain", "payload", "push", "bridge", "fall", "fault", "stop"}


def test_every_code_has_a_kind_and_a_meaning() -> None:
    declared = {v for k, v in vars(codes).items() if k.isupper() and isinstance(v, str)}
    assert declared == codes.EVENTS.keys()
    assert {code.kind for code in codes.EVENTS.values()} == KINDS
    assert all(code.meaning for code in codes.EVENTS.values())


def test_an_event_keeps_its_code_on_the_wire() -> None:
    event = Event(5, 5_000_000, "fault", "r1", "in any words", codes.BACK)
    assert decode(encode(event), Event) == event


@pytest.mark.parametrize(
    ("kind", "detail", "code"),
    [
        ("start", "3 robots, line yokes", codes.START),
        ("fall", "tilt 1.05 rad, height 0.100 m", codes.FALL),
        ("fault", "FL_calf gives 60 % of its torque", codes.WEAK_MOTOR),
        ("fault", "silent for 10 s: its joints are damped, the world goes on", codes.SILENT),
        ("fault", "gone: its joints are damped, the world goes on", codes.GONE),
        ("fault", "answers again", codes.BACK),
        ("fault", "3 commands dropped: command: got schema 'x'", codes.MALFORMED),
        ("stop", "end of world.seconds", codes.TIME_OVER),
        ("stop", "end of world.seconds; late ticks: none", codes.TIME_OVER),
        ("stop", "fall of r1, r2", codes.FALLEN),
        ("stop", "signal; late ticks: r1 held 3", codes.SIGNAL),
    ],
)
def test_an_event_of_schema_1_is_read_with_the_code_it_would_have(
    kind: str, detail: str, code: str
) -> None:
    found = decode(schema_1(kind=kind, detail=detail), Event)
    assert found == Event(7, 7_000_000, kind, "r1", detail, code)


def schema_1(**changes: Any) -> bytes:
    body = {"schema": 1, "tick": 7, "stamp_ns": 7_000_000, "kind": "fall", "robot": "r1"}
    packed: bytes = msgpack.packb(body | {"detail": ""} | changes)
    return packed


@pytest.mark.parametrize(
    "change", [{"kind": 1}, {"detail": None}, {"schema": 0}, {"schema": 3}, {"more": 1}], ids=str
)
def test_what_was_no_event_then_is_none_now(change: dict[str, Any]) -> None:
    with pytest.raises(MessageError, match="event"):
        decode(schema_1(**change), Event)


def test_the_code_of_a_status_or_reason_stands_before_its_detail() -> None:
    assert codes.with_detail("estop", "fall: a dog") == "estop:fall: a dog"
    assert codes.code_of("nominal:infeasible") == "nominal"
    assert codes.code_of("estop:fall: a dog") == "estop"
    assert (codes.code_of("solved"), codes.code_of("")) == ("solved", "")
