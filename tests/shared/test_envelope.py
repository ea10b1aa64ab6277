"""Reading tick and stamp without decoding."""

from __future__ import annotations

import msgpack
from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared.codec import MAX_INTEGER, MAX_TICK, encode, envelope
from quadriga.shared.messages import EStop, Event

ticks = st.integers(0, MAX_TICK - 1)
stamps = st.integers(0, MAX_INTEGER - 1)


@given(tick=ticks, stamp_ns=stamps)
def test_reads_what_encode_wrote(tick: int, stamp_ns: int) -> None:
    assert envelope(encode(EStop(tick, stamp_ns, "tripped"))) == (tick, stamp_ns)


@given(tick=ticks, stamp_ns=stamps)
def test_any_order_of_fields_is_read(tick: int, stamp_ns: int) -> None:
    body = {"reason": "", "stamp_ns": stamp_ns, "tick": tick, "schema": 1}
    assert envelope(msgpack.packb(body)) == (tick, stamp_ns)


@given(payload=st.binary(max_size=64))
def test_noise_is_never_an_error(payload: bytes) -> None:
    found = envelope(payload)
    assert found is None or min(found) >= 0


def test_a_cut_message_has_no_envelope() -> None:
    whole = encode(Event(70_000, 70_000_000_000, "fall", "r1", "", "fall"))
    for length in range(len(whole) - 1):
        found = envelope(whole[:length])
        assert found in (None, (70_000, 70_000_000_000))
    assert envelope(whole[:20]) is None


def test_wrong_types_have_no_envelope() -> None:
    for tick in ("7", -1, 7.0, True, None, 1 << 63):
        assert envelope(msgpack.packb({"schema": 1, "tick": tick, "stamp_ns": 0})) is None
    assert envelope(msgpack.packb([1, 2, 3])) is None


def test_what_the_codec_would_refuse_is_no_envelope() -> None:
    for tick, stamp_ns in ((MAX_TICK, 0), (0, MAX_INTEGER)):
        assert envelope(encode(EStop(tick, stamp_ns, ""))) is None
        body = {"stamp_ns": stamp_ns, "tick": tick, "schema": 1}
        assert envelope(msgpack.packb(body)) is None
