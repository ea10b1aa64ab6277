"""The codec gives back what it was given and refuses everything else with one kind of error."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.shared.codec import (
    MAX_BYTES,
    MAX_INTEGER,
    MAX_TEXT,
    MAX_TICK,
    decode,
    encode,
    truncate_text,
)
from quadriga.shared.errors import MessageError
from quadriga.shared.messages import Command, Message, Plan, State, Status, Truth
from quadriga.shared.robots.conventions import Array
from quadriga.shared.topics import TABLE

TYPES = [topic.type for topic in TABLE]
of_every_type = pytest.mark.parametrize("kind", TYPES, ids=lambda kind: kind.__name__)

few = settings(max_examples=40)

_finite = st.floats(allow_nan=False, allow_infinity=False)
_text = st.text(max_size=20)
_PLAIN: dict[tuple[type, bool], st.SearchStrategy[Any]] = {
    (bool, False): st.booleans(),
    (int, True): st.integers(0, MAX_INTEGER - 1),
    (float, False): _finite,
    (str, False): _text,
    (list, False): st.lists(_text, max_size=5).map(tuple),
    (dict, True): st.dictionaries(_text, st.integers(0, 1 << 40), max_size=5),
    (dict, False): st.dictionaries(_text, _finite, max_size=5),
}


def _any_bits(shape: list[int], seed: int) -> Array:
    """An array of arbitrary bit patterns, NaN and infinity replaced by zero."""
    bits = np.random.default_rng(seed).bytes(8 * int(np.prod(shape)))
    numbers = np.frombuffer(bits).reshape(shape)
    return np.where(np.isfinite(numbers), numbers, 0.0)


@st.composite
def messages(draw: st.DrawFn, kind: type[Message]) -> Message:
    """A message of a type whose every field is arbitrary within the schema."""
    lengths: dict[str, int] = {}
    values: dict[str, Any] = {}
    for item in fields(kind):
        if "shape" in item.metadata:
            shape = [
                d if isinstance(d, int) else lengths.setdefault(d, draw(st.integers(0, 7)))
                for d in item.metadata["shape"]
            ]
            values[item.name] = _any_bits(shape, draw(st.integers(0, 1 << 32)))
        else:
            of = item.metadata["kind"]
            values[item.name] = draw(_PLAIN[of, "int" in str(item.type)])
    values["tick"] %= MAX_TICK
    return kind(**values)


def body_of(kind: type[Message]) -> dict[str, Any]:
    """The MessagePack map of a valid message whose arrays are zero, lengths 3."""
    values: dict[str, Any] = {}
    for item in fields(kind):
        shape = item.metadata.get("shape")
        values[item.name] = (
            np.zeros([3 if isinstance(d, str) else d for d in shape])
            if shape
            else item.metadata["kind"]()
        )
    body: dict[str, Any] = msgpack.unpackb(encode(kind(**values)))
    return body


@of_every_type
@few
@given(data=st.data())
def test_round_trip(kind: type[Message], data: st.DataObject) -> None:
    message = data.draw(messages(kind))
    received = decode(encode(message), kind)
    for item in fields(kind):
        sent, got = getattr(message, item.name), getattr(received, item.name)
        if "shape" in item.metadata:
            assert got.shape == sent.shape
            assert got.tobytes() == sent.tobytes()
        else:
            assert got == sent


@of_every_type
@few
@given(data=st.data())
def test_equal_messages_give_equal_bytes(kind: type[Message], data: st.DataObject) -> None:
    payload = encode(data.draw(messages(kind)))
    assert encode(decode(payload, kind)) == payload


@of_every_type
def test_field_order_on_the_wire_is_free(kind: type[Message]) -> None:
    turned = dict(reversed(body_of(kind).items()))
    assert decode(msgpack.packb(turned), kind).tick == 0


@of_every_type
@few
@given(cut=st.integers(0, 10_000))
def test_truncated_bytes_are_refused(kind: type[Message], cut: int) -> None:
    payload = msgpack.packb(body_of(kind))
    with pytest.raises(MessageError):
        decode(payload[: cut % len(payload)], kind)


@of_every_type
@few
@given(noise=st.binary(max_size=600))
def test_noise_is_refused(kind: type[Message], noise: bytes) -> None:
    with pytest.raises(MessageError):
        decode(noise, kind)


@of_every_type
@few
@given(body=st.dictionaries(_text, st.one_of(st.none(), _finite, st.binary(max_size=20), _text)))
def test_foreign_maps_are_refused(kind: type[Message], body: dict[str, Any]) -> None:
    with pytest.raises(MessageError):
        decode(msgpack.packb(body), kind)


@of_every_type
@few
@given(data=st.data())
def test_every_field_refuses_a_foreign_value(kind: type[Message], data: st.DataObject) -> None:
    item = data.draw(st.sampled_from(fields(kind)))
    wrong: Any = data.draw(st.sampled_from([None, True, [1], b"short", {"a": "b"}, -1, 1 << 63]))
    if item.metadata.get("kind") is float and type(wrong) is int:
        wrong = float("nan")
    if item.metadata.get("kind") is bool and wrong is True:
        wrong = 1
    body = {**body_of(kind), item.name: wrong}
    with pytest.raises(MessageError, match=rf"{kind.__name__.lower()}\.{item.name}"):
        decode(msgpack.packb(body), kind)


@pytest.mark.parametrize(
    "kind", [k for k in TYPES if any("shape" in f.metadata for f in fields(k))]
)
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_no_array_may_hold_nan_or_infinity(kind: type[Message], bad: float) -> None:
    for item in fields(kind):
        if "shape" in item.metadata:
            body = body_of(kind)
            array = np.frombuffer(body[item.name]).copy()
            array[-1] = bad
            body[item.name] = array.tobytes()
            with pytest.raises(MessageError, match=f"{item.name}: got NaN or infinity"):
                decode(msgpack.packb(body), kind)


def test_shape_of_every_fixed_array_is_checked() -> None:
    for kind in (State, Command):
        for item in fields(kind):
            if "shape" in item.metadata:
                body = body_of(kind)
                body[item.name] = body[item.name][:-8]
                with pytest.raises(MessageError, match=f"{item.name}: got .* bytes, expected"):
                    decode(msgpack.packb(body), kind)


def test_bytes_moved_from_one_array_to_another_are_refused() -> None:
    body = body_of(Command)
    body["tau"], body["kd"] = body["tau"] + bytes(8), body["kd"][:-8]
    with pytest.raises(MessageError, match="tau"):
        decode(msgpack.packb(body), Command)


@pytest.mark.parametrize(("kind", "name"), [(Plan, "y"), (Truth, "base_vel")])
def test_arrays_that_share_a_length_must_agree(kind: type[Message], name: str) -> None:
    body = body_of(kind)
    body[name] = body[name][: len(body[name]) * 2 // 3]
    with pytest.raises(MessageError, match=name):
        decode(msgpack.packb(body), kind)


def test_arrays_of_own_length_may_differ() -> None:
    empty = np.zeros(0)
    status = Status(7, 7, "walk", "", "kalman", {}, {}, planner_ms=empty, tick_us=np.ones(40))
    assert decode(encode(status), Status).tick_us.shape == (40,)


@pytest.mark.parametrize("schema", [0, 2, True, None, "1"])
def test_another_schema_version_is_refused(schema: object) -> None:
    with pytest.raises(MessageError, match="another version of quadriga"):
        decode(msgpack.packb({**body_of(State), "schema": schema}), State)


def test_missing_and_unknown_fields_are_named() -> None:
    body = body_of(State)
    body["voltage"] = body.pop("foot_force")
    with pytest.raises(MessageError, match=r"missing=\['foot_force'\] unknown=\['voltage'\]"):
        decode(msgpack.packb(body), State)


def nested(depth: int) -> list[Any]:
    """A list within a list, so many times."""
    value: list[Any] = []
    for _ in range(depth):
        value = [value]
    return value


LONG = 900_001  # characters or bytes, nearly what a message may be, and no whole float64s


@of_every_type
@pytest.mark.parametrize(
    "wrong",
    [nested(1000), "x" * LONG, "\x00" * LONG, b"x" * LONG, {"\x00" * LONG: -1}],
    ids=["nested", "text", "control", "bytes", "map"],
)
def test_the_error_about_any_value_is_a_short_line(kind: type[Message], wrong: Any) -> None:
    for name, body in (("schema", body_of(kind)), *((f.name, body_of(kind)) for f in fields(kind))):
        with pytest.raises(MessageError) as caught:
            decode(msgpack.packb({**body, name: wrong}), kind)
        assert len(str(caught.value)) < 300
        assert str(caught.value).isprintable()


def test_the_error_about_foreign_fields_is_a_short_line() -> None:
    strange = {f"key {i}": i for i in range(50_000)}
    with pytest.raises(MessageError) as caught:
        decode(msgpack.packb({**body_of(Command), **strange}), Command)
    assert len(str(caught.value)) < 300
    assert "missing=[] unknown=['key 0', " in str(caught.value)
    with pytest.raises(MessageError) as caught:
        decode(msgpack.packb({**body_of(Command), "x" * LONG: 1}), Command)
    assert len(str(caught.value)) < 300


def test_text_is_made_fit_for_a_message() -> None:
    for text in ("", "Stürz", "x" * MAX_TEXT):
        assert truncate_text(text) == text
    assert truncate_text("x" * (MAX_TEXT + 1)) == "x" * (MAX_TEXT - 1) + "…"
    assert truncate_text("St\udcfcrz", 4) == "St?…"


def test_a_huge_message_is_refused_before_it_is_parsed() -> None:
    with pytest.raises(MessageError, match=f"at most {MAX_BYTES}"):
        decode(bytes(MAX_BYTES + 1), State)


def test_a_tick_whose_nanoseconds_do_not_fit_is_refused() -> None:
    assert decode(msgpack.packb({**body_of(State), "tick": MAX_TICK - 1}), State).tick
    with pytest.raises(MessageError, match=r"state\.tick"):
        decode(msgpack.packb({**body_of(State), "tick": MAX_TICK}), State)


def test_decoded_arrays_cannot_be_written() -> None:
    state = decode(msgpack.packb(body_of(State)), State)
    with pytest.raises(ValueError, match="read-only"):
        state.q_joint[0] = 1.0
