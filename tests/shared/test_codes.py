"""Programs decide by codes: each is in the table."""

from __future__ import annotations

from quadriga.shared import codes
from quadriga.shared.codec import decode, encode
from quadriga.shared.messages import Event

KINDS = {"start", "terrain", "payload", "push", "bridge", "fall", "fault", "stop"}


def test_every_code_has_a_kind_and_a_meaning() -> None:
    declared = {v for k, v in vars(codes).items() if k.isupper() and isinstance(v, str)}
    assert declared == codes.EVENTS.keys()
    assert {code.kind for code in codes.EVENTS.values()} == KINDS
    assert all(code.meaning for code in codes.EVENTS.values())


def test_an_event_keeps_its_code_on_the_wire() -> None:
    event = Event(5, 5_000_000, "fault", "r1", "in any words", codes.RESET)
    assert decode(encode(event), Event) == event


def test_the_code_of_a_status_or_reason_stands_before_its_detail() -> None:
    assert codes.with_detail("estop", "fall: a dog") == "estop:fall: a dog"
    assert codes.code_of("nominal:infeasible") == "nominal"
    assert codes.code_of("estop:fall: a dog") == "estop"
    assert (codes.code_of("solved"), codes.code_of("")) == ("solved", "")
