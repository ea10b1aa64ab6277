"""The codec gives back what it was given and refuses everything else with one kind of error."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.shared import codec
from quadriga.shared.codec import (
    MAX_BYTES,
    MAX_INTEGER,
    MAX_TEXT,
    MAX_TICK,
    decode,
    encode,
    envelope,
    truncate_text,
)
from quadriga.shared.errors import MessageError
from quadriga.shared.messages import Command, EStop, Flat, Message, Plan, State, Status, Truth
from quadriga.shared.robots.conventions import Array
from quadriga.shared.topics import TABLE

TYPES = [*dict.fromkeys(topic.type for topic in TABLE)]
of_every_type = pytest.mark.parametrize("kind", TYPES, ids=lambda kind: kind.__name__)
of_every_flat_type = pytest.mark.parametrize("kind", [State, Command])

few = settings(max_examples=40)

_finite = st.floats(allow_nan=False, allow_infinity=False)
_text = st.text(max_size=20)
_stamps = st.integers(0, MAX_INTEGER - 1)
_ticks = st.sampled_from([0, 1, 127, 128, 255, 256, 65535, 65536, 2**32 - 1, 2**32, MAX_TICK - 1])
_PLAIN: dict[tuple[type, bool], st.SearchStrategy[Any]] = {
    (bool, False): st.booleans(),
    (int, True): _stamps,
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
    values["tick"] = draw(_ticks)
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


def refusal(body: Any, kind: type[Message]) -> MessageError:
    with pytest.raises(MessageError) as caught:
        decode(body if isinstance(body, bytes) else msgpack.packb(body), kind)
    return caught.value


@of_every_type
@few
@given(data=st.data())
def test_round_trip(kind: type[Message], data: st.DataObject) -> None:
    message = data.draw(messages(kind))
    payload = encode(message)
    received = decode(payload, kind)
    for item in fields(kind):
        sent, got = getattr(message, item.name), getattr(received, item.name)
        if "shape" in item.metadata:
            assert got.shape == sent.shape
            assert got.tobytes() == sent.tobytes()
        else:
            assert got == sent
    assert encode(received) == payload
    assert envelope(payload) == (message.tick, message.stamp_ns)
    turned = msgpack.packb(dict(reversed(msgpack.unpackb(payload).items())))
    assert encode(decode(turned, kind)) == payload, "any order of fields is taken"
    assert envelope(turned) == envelope(payload)


@given(
    kind=st.sampled_from(TYPES),
    cut=st.integers(0, 10_000),
    noise=st.binary(max_size=600),
    body=st.dictionaries(_text, st.one_of(st.none(), _finite, st.binary(max_size=20), _text)),
)
def test_truncated_bytes_noise_and_foreign_maps_are_refused(
    kind: type[Message], cut: int, noise: bytes, body: dict[str, Any]
) -> None:
    payload = msgpack.packb({**body_of(kind), "tick": 70_000})
    part = payload[: cut % len(payload)]
    refusal(part, kind)
    assert envelope(part) in (None, (70_000, 0)), "whole or none"
    refusal(noise, kind)
    found = envelope(noise)
    assert found is None or min(found) >= 0
    refusal(body, kind)


@settings(max_examples=200)
@given(kind=st.sampled_from(TYPES), data=st.data())
def test_every_field_refuses_a_foreign_value(kind: type[Message], data: st.DataObject) -> None:
    item = data.draw(st.sampled_from(fields(kind)))
    wrong: Any = data.draw(st.sampled_from([None, True, [1], b"short", {"a": "b"}, -1, 1 << 63]))
    if item.metadata.get("kind") is float and type(wrong) is int:
        wrong = float("nan")
    if item.metadata.get("kind") is bool and wrong is True:
        wrong = 1
    error = refusal({**body_of(kind), item.name: wrong}, kind)
    assert error.name == f"{kind.__name__.lower()}.{item.name}"


@of_every_type
def test_an_array_is_of_its_shape_and_of_finite_numbers(kind: type[Message]) -> None:
    for item in fields(kind):
        body, raw = body_of(kind), body_of(kind)[item.name]
        if "shape" not in item.metadata:
            continue
        bad = (np.nan, np.inf, -np.inf) if item.metadata["finite"] else ()
        wrong = [raw[:-8] + np.float64(number).tobytes() for number in bad]
        fixed = all(isinstance(d, int) for d in item.metadata["shape"])
        for array in (*wrong, raw[:-1], *([raw[:-8]] if fixed else [])):
            error = refusal({**body, item.name: array}, kind)
            assert error.name == f"{kind.__name__.lower()}.{item.name}"


@pytest.mark.parametrize(("kind", "name"), [(Plan, "y"), (Truth, "base_vel")])
def test_arrays_that_share_a_length_must_agree(kind: type[Message], name: str) -> None:
    body = body_of(kind)
    body[name] = body[name][: len(body[name]) * 2 // 3]
    assert refusal(body, kind).name.endswith(name)
    empty = np.zeros(0)
    status = Status(7, 7, "walk", "", "kalman", {}, {}, planner_ms=empty, tick_us=np.ones(40))
    assert decode(encode(status), Status).tick_us.shape == (40,)


def test_another_schema_version_and_other_fields_are_refused() -> None:
    body = body_of(State)
    for schema in (0, 2, True, None, "1"):
        assert "another version" in refusal({**body, "schema": schema}, State).cause
    body["voltage"] = body.pop("foot_force")
    assert refusal(body, State).got == "missing=['foot_force'] unknown=['voltage']"


def nested(depth: int) -> list[Any]:
    """A list within a list, so many times."""
    value: list[Any] = []
    for _ in range(depth):
        value = [value]
    return value


LONG = 900_001  # characters or bytes, nearly what a message may be, and no whole float64s


@of_every_type
@pytest.mark.parametrize("wrong", [nested(1000), "\x00" * LONG, b"x" * LONG, {"\x00" * LONG: -1}])
def test_the_error_about_any_value_is_a_short_line(kind: type[Message], wrong: Any) -> None:
    for name in ("schema", "x" * LONG, *(item.name for item in fields(kind))):
        text = str(refusal({**body_of(kind), name: wrong}, kind))
        assert len(text) < 300
        assert text.isprintable()


def test_text_is_made_fit_for_a_message() -> None:
    for text in ("", "Stürz", "x" * MAX_TEXT):
        assert truncate_text(text) == text
    assert truncate_text("x" * (MAX_TEXT + 1)) == "x" * (MAX_TEXT - 1) + "…"
    assert truncate_text("St\udcfcrz", 4) == "St?…"


def test_limits_of_size_and_time() -> None:
    assert refusal(bytes(MAX_BYTES + 1), State).expected == f"at most {MAX_BYTES}"
    assert decode(msgpack.packb({**body_of(State), "tick": MAX_TICK - 1}), State).tick
    assert refusal({**body_of(State), "tick": MAX_TICK}, State).name == "state.tick"
    for tick, stamp_ns in ((MAX_TICK, 0), (0, MAX_INTEGER), (-1, 0), ("7", 0), (True, 0)):
        assert envelope(msgpack.packb({"schema": 1, "tick": tick, "stamp_ns": stamp_ns})) is None
    assert envelope(encode(EStop(MAX_TICK, 0, ""))) is None


def test_decoded_arrays_cannot_be_written() -> None:
    for payload in (encode(message(State, 5, 0)), msgpack.packb(body_of(State))):
        with pytest.raises(ValueError, match="read-only"):
            decode(payload, State).q_joint[0] = 1.0


def message(kind: type[Flat], tick: int, seed: int) -> Any:
    """A message of random numbers."""
    row = np.random.default_rng(seed).standard_normal([*kind.CUTS.values()][-1].stop)
    return kind.from_row(tick, 1_000_000 * tick, row)


def outcome(payload: bytes, kind: type[Flat]) -> Any:
    """All numbers of a decoded message, or the text of its refusal."""
    try:
        found = decode(payload, kind)
    except MessageError as error:
        return str(error)
    return found.tick, found.stamp_ns, found.row.tobytes()


@of_every_flat_type
@given(tick=_ticks, seed=st.integers(0, 1000))
def test_the_bytes_of_a_row_are_those_of_messagepack(
    kind: type[Flat], tick: int, seed: int
) -> None:
    sent = message(kind, tick, seed)
    arrays = {name: getattr(sent, name).tobytes() for name in kind.CUTS}
    body = {"schema": kind.SCHEMA, "tick": tick, "stamp_ns": sent.stamp_ns, **arrays}
    assert encode(sent) == msgpack.packb(body)
    flat = codec._layout(kind).flat
    assert flat is not None
    read = flat.read(arrays)
    assert read is not None
    assert read.tobytes() == sent.row.tobytes()


@of_every_flat_type
@given(
    tick=_ticks,
    at=st.integers(0, 700),
    bits=st.integers(1, 255),
    cut=st.integers(0, 3),
    extra=st.binary(max_size=2),
)
def test_damaged_bytes_come_to_the_same_either_way(
    kind: type[Flat], tick: int, at: int, bits: int, cut: int, extra: bytes
) -> None:
    payload = bytearray(encode(message(kind, tick, 3)))
    payload[at % len(payload)] ^= bits
    damaged = bytes(payload[: len(payload) - cut]) + extra
    quick = outcome(damaged, kind)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(codec._layout(kind), "flat", None)
        assert outcome(damaged, kind) == quick


def test_a_command_is_made_of_arrays_by_place_or_name() -> None:
    parts = {name: np.full(12, float(k)) for k, name in enumerate(Command.CUTS)}
    turned = dict(reversed(parts.items()))
    assert Command(0, 0, **turned).row.tobytes() == Command(0, 0, *parts.values()).row.tobytes()
    assert replace(Command(0, 0, **parts), kp=np.ones(12)).kp[0] == 1.0
    for wrong in ({"torque": np.zeros(12)}, {"kp": np.zeros(11)}):
        with pytest.raises((TypeError, ValueError), match="expected"):
            Command(0, 0, **{**parts, **wrong})
