"""The quick way is the general one: the same bytes, the same messages, the same refusals."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import msgpack
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared import codec
from quadriga.shared.codec import decode, encode
from quadriga.shared.errors import MessageError
from quadriga.shared.messages import Command, Measurement, Message, State

TYPES = (State, Command)
of_every_type = pytest.mark.parametrize("kind", TYPES, ids=lambda kind: kind.__name__)
_ticks = st.sampled_from([0, 1, 127, 128, 255, 256, 65535, 65536, 2**32 - 1, 2**32, 2**42 - 1])


def message(kind: type[Message], tick: int, seed: int) -> Any:
    """A message of random numbers."""
    random = np.random.default_rng(seed)
    shapes = [item.metadata["shape"] for item in fields(kind) if "shape" in item.metadata]
    return kind(tick, 1_000_000 * tick, *(random.standard_normal(shape) for shape in shapes))


def general(payload: bytes, kind: type[Message], monkeypatch: pytest.MonkeyPatch) -> Any:
    """What the general way makes of a payload: a message, or its refusal."""
    with monkeypatch.context() as patch:
        patch.setattr(codec._layout(kind), "flat", None)
        return outcome(payload, kind)


def outcome(payload: bytes, kind: type[Message]) -> Any:
    """All numbers of a decoded message, or the text of its refusal."""
    try:
        found = decode(payload, kind)
    except MessageError as error:
        return str(error)
    arrays = [getattr(found, item.name) for item in fields(kind) if "shape" in item.metadata]
    return found.tick, found.stamp_ns, *(array.tobytes() for array in arrays)


@of_every_type
@given(tick=_ticks, seed=st.integers(0, 1000))
def test_the_bytes_are_those_of_messagepack(kind: type[Message], tick: int, seed: int) -> None:
    sent = message(kind, tick, seed)
    body: dict[str, Any] = {"schema": kind.SCHEMA, "tick": tick, "stamp_ns": sent.stamp_ns}
    for item in fields(kind):
        if "shape" in item.metadata:
            body[item.name] = getattr(sent, item.name).tobytes()
    assert encode(sent) == msgpack.packb(body)


@of_every_type
@given(tick=_ticks, seed=st.integers(0, 1000))
def test_it_is_taken_for_what_encode_writes(kind: type[Message], tick: int, seed: int) -> None:
    found = codec._layout(kind).flat.read(encode(message(kind, tick, seed)))  # type: ignore[union-attr]
    assert found is not None
    assert found[0] == tick


@of_every_type
@given(
    tick=_ticks,
    at=st.integers(0, 700),
    bits=st.integers(1, 255),
    cut=st.integers(0, 3),
    extra=st.binary(max_size=2),
)
def test_damaged_bytes_come_to_the_same_either_way(
    kind: type[Message], tick: int, at: int, bits: int, cut: int, extra: bytes
) -> None:
    payload = bytearray(encode(message(kind, tick, 3)))
    payload[at % len(payload)] ^= bits
    damaged = bytes(payload[: len(payload) - cut]) + extra
    with pytest.MonkeyPatch.context() as patch:
        assert outcome(damaged, kind) == general(damaged, kind, patch)


@of_every_type
@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf])
def test_what_is_no_number_is_refused_by_name(kind: type[Message], number: float) -> None:
    sent = message(kind, 5, 0)
    last = fields(kind)[-1].name
    values = getattr(sent, last).copy()
    values[-1] = number
    with pytest.raises(MessageError, match=last):
        decode(encode(replace(sent, **{last: values})), kind)


def test_an_array_of_another_size_is_refused() -> None:
    zero = np.zeros(12)
    with pytest.raises(ValueError, match=r"Command.kp: got shape \(11,\), expected \(12,\)"):
        Command(0, 0, zero, zero, zero, np.zeros(11), zero)


def test_names_and_places_come_to_the_same() -> None:
    parts = {name: np.full(12, k) for k, name in enumerate(Command.CUTS)}
    assert Command(0, 0, **parts).row.tobytes() == Command(0, 0, *parts.values()).row.tobytes()
    with pytest.raises(TypeError, match="expected"):
        Command(0, 0, **{**parts, "torque": np.zeros(12)})
