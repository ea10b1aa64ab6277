"""Bytes ↔ messages: MessagePack maps, arrays as little-endian float64; all wire validation.

`encode` writes the map's keys in one order: schema, tick, stamp, what is no array, arrays. `decode`
takes any order, checks every field and gives arrays as read-only views.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from math import isfinite, prod
from typing import Any, Final, TypeVar

import msgpack
import numpy as np

from quadriga.shared.errors import MessageError
from quadriga.shared.messages import Flat, Message
from quadriga.shared.robots.conventions import Array

M = TypeVar("M", bound=Message)

MAX_BYTES = 1 << 20  # a message larger than this is refused before it is parsed
MAX_TICK = 1 << 42  # 139 years of ms, so that a tick in ns is still an integer of the wire
MAX_INTEGER = 1 << 62  # integers of all other fields are below
MAX_TEXT = 4096  # characters
# Characters of what is wrong with a message: errors become events and log lines.
_MAX_DESCRIPTION: Final = 120
_HEAD: Final = b"\xa6schema\x01\xa4tick"  # what `encode` writes after the map's own byte
_STAMP: Final = b"\xa8stamp_ns"
_WIDTH: Final = {0xCC: 1, 0xCD: 2, 0xCE: 4, 0xCF: 8}  # MessagePack's unsigned integers
_FLOAT64: Final = np.dtype("<f8")
_UNREADABLE: Final = (ValueError, TypeError, msgpack.exceptions.UnpackException)
_EXPECTED: Final = {
    bool: "true or false",
    int: "an integer ≥ 0 and below 2**62, a tick below 2**42",
    float: "a finite number",
    str: f"text of at most {MAX_TEXT} characters",
    list: "a list of text",
    dict: "a map",
}


def encode(message: Message) -> bytes:
    """The wire form of a message. Equal messages give equal bytes. Nothing is checked."""
    layout = _layout(type(message))
    if layout.flat is not None and isinstance(message, Flat):
        return layout.flat.write([message.tick], message.row[None], message.stamp_ns)[0]
    body: dict[str, Any] = {"schema": message.SCHEMA}
    for name in layout.plain:
        body[name] = getattr(message, name)
    for name in layout.shapes:
        body[name] = np.ascontiguousarray(getattr(message, name), dtype=_FLOAT64).tobytes()
    packed: bytes = msgpack.packb(body)
    return packed


def encode_rows(kind: type[Flat], ticks: Sequence[int], rows: Array) -> list[bytes]:
    """What `encode` gives for the messages of these ticks and rows, (n, size of a row).

    Stamps are those of the ticks. A recorder writes thousands a second.
    """
    flat = _layout(kind).flat
    return [] if flat is None or not ticks else flat.write(ticks, rows)


def decode(payload: bytes, kind: type[M]) -> M:
    """The message of type `kind` in `payload`; its arrays are read-only views.

    Raises:
        MessageError: not MessagePack, wrong schema version, fields missing or unknown,
            wrong type or shape, or a number that is not finite.
    """
    layout = _layout(kind)
    if len(payload) > MAX_BYTES:
        raise _error(kind, f"{len(payload)} bytes", f"at most {MAX_BYTES}", "a foreign publisher?")
    try:
        body = msgpack.unpackb(payload)
    except _UNREADABLE as error:
        got = f"{len(payload)} bytes that do not parse ({error})"
        raise _error(kind, got, "a MessagePack map", "truncated or corrupt message") from None
    if not isinstance(body, dict):
        raise _error(kind, type(body).__name__, "a MessagePack map", "a foreign publisher?")
    schema = body.pop("schema", None)
    if schema != kind.SCHEMA or isinstance(schema, bool):
        cause = "another version of quadriga"
        raise _error(kind, f"schema {_describe(schema)}", f"schema {kind.SCHEMA}", cause)
    names = {*layout.plain, *layout.shapes}
    if body.keys() != names:
        missing = sorted(names - body.keys())
        unknown = sorted(str(key) for key in body.keys() - names)
        raise _error(kind, f"{missing=} {unknown=}", "exactly the fields of the type")
    if layout.flat is not None and (row := layout.flat.read(body)) is not None:
        head = (_check(kind, name, int, int, body[name]) for name in ("tick", "stamp_ns"))
        made: M = layout.flat.kind.from_row(*head, row)
        return made
    values: dict[str, Any] = dict(_read_arrays(kind, layout, body))
    for name, of in layout.plain.items():
        values[name] = _check(kind, name, *of, body[name])
    return kind(**values)


def envelope(payload: bytes) -> tuple[int, int] | None:
    """`(tick, stamp_ns)` of a message, or None if its bytes do not carry them.

    Costs about 1 µs for bytes that `encode` wrote, and a full parse for any other order of the same
    fields. Nothing but these two fields is validated, as `decode` would.
    """
    tick: Any = None
    stamp_ns: Any = None
    if payload[1 : 1 + len(_HEAD)] == _HEAD and (found := _read_head(payload, 1 + len(_HEAD))):
        tick, stamp_ns, _ = found
    elif len(payload) <= MAX_BYTES:  # else nobody's message, and parsed it may take a hundredfold
        try:
            body = msgpack.unpackb(payload)
        except _UNREADABLE:
            return None
        if isinstance(body, dict):
            tick, stamp_ns = body.get("tick"), body.get("stamp_ns")
    if type(tick) is not int or type(stamp_ns) is not int:
        return None
    return (tick, stamp_ns) if 0 <= tick < MAX_TICK and 0 <= stamp_ns < MAX_INTEGER else None


def truncate_text(text: str, limit: int = MAX_TEXT) -> str:
    """`text` as a message may hold it: cut to `limit` characters, a `?` for what UTF-8 cannot say.

    What was typed in a terminal of another encoding holds such characters.
    """
    text = text if len(text) <= limit else f"{text[: limit - 1]}…"
    return text.encode("utf-8", "replace").decode("utf-8")


class _Layout:
    """What the codec must know of one message type, computed once.

    Attributes:
        shapes: of arrays, by name.
        plain: of all other fields: their type, and that of a map's values.
        infinite: names of arrays that may hold what is not finite.
        flat: of a type whose numbers are all in one row.
    """

    def __init__(self, kind: type[Message]) -> None:
        self.shapes: dict[str, tuple[int | str, ...]] = {}
        self.plain: dict[str, tuple[type, type]] = {}
        self.infinite = set[str]()
        for item in fields(kind):
            if "shape" in item.metadata:
                self.shapes[item.name] = item.metadata["shape"]
                self.infinite |= set() if item.metadata["finite"] else {item.name}
            else:
                self.plain[item.name] = item.metadata["kind"], int if "int" in item.type else float
        self.flat = _FlatLayout(kind) if issubclass(kind, Flat) else None


def _layout(kind: type[Message]) -> _Layout:
    found = _LAYOUTS.get(kind)
    if found is None:
        found = _LAYOUTS[kind] = _Layout(kind)
    return found


_LAYOUTS: Final[dict[type[Message], _Layout]] = {}


class _FlatLayout:
    """The bytes of a type whose numbers are all in one row: only they, tick and stamp differ."""

    def __init__(self, kind: type[Flat]) -> None:
        self.kind: Any = kind
        self._cuts = {n: slice(8 * c.start, 8 * c.stop) for n, c in kind.CUTS.items()}  # bytes
        empty = msgpack.packb({"schema": kind.SCHEMA, "tick": 0})
        self._head: bytes = bytes([empty[0] + 1 + len(self._cuts)]) + empty[1:-1]  # of a larger map
        # What follows the stamp: each field's name, and its numbers, here zeros.
        body, self._places = b"", list[slice]()
        for name, cut in self._cuts.items():
            body += msgpack.packb({name: bytes(cut.stop - cut.start)})[1:]
            self._places.append(slice(len(body) - (cut.stop - cut.start), len(body)))
        self._body: Any = np.frombuffer(body, np.uint8)

    def write(self, ticks: Sequence[int], rows: Array, stamp_ns: int | None = None) -> list[bytes]:
        """The messages' bytes, those of MessagePack; the stamps are those of the ticks, or this."""
        raw, size = np.ascontiguousarray(rows, _FLOAT64).view(np.uint8), len(self._body)
        bodies = np.empty((len(rows), size), np.uint8)
        bodies[:] = self._body
        for place, cut in zip(self._places, self._cuts.values(), strict=True):
            bodies[:, place] = raw[:, cut]
        numbers, pack, written = bodies.tobytes(), msgpack.packb, list[bytes]()
        for k, tick in enumerate(ticks):
            stamp = pack(1_000_000 * tick if stamp_ns is None else stamp_ns)
            parts = self._head, pack(tick), _STAMP, stamp, numbers[k * size : (k + 1) * size]
            written.append(b"".join(parts))
        return written

    def read(self, body: Mapping[str, Any]) -> Array | None:
        """The row of a map's arrays; None if one is none, or not of its size, or not finite."""
        parts = [body[name] for name in self._cuts]
        for part, cut in zip(parts, self._cuts.values(), strict=True):
            if not isinstance(part, bytes) or len(part) != cut.stop - cut.start:
                return None
        row = np.frombuffer(bytearray().join(parts), _FLOAT64)
        return row if _all_finite(row) else None


def _read_head(payload: bytes, at: int) -> tuple[int, int, int] | None:
    """Tick at `at`, the stamp behind it and where that ends; None if the bytes are no such."""
    try:
        tick, end = _read_unsigned(payload, at)
        if payload[end : end + len(_STAMP)] != _STAMP:
            return None
        return tick, *_read_unsigned(payload, end + len(_STAMP))
    except (IndexError, KeyError):
        return None


def _read_unsigned(payload: bytes, at: int) -> tuple[int, int]:
    first = payload[at]
    if first < 0x80:
        return first, at + 1
    end = at + 1 + _WIDTH[first]
    if end > len(payload):
        raise IndexError(end)
    return int.from_bytes(payload[at + 1 : end], "big"), end


def _read_arrays(kind: type[Message], layout: _Layout, body: Mapping[str, Any]) -> dict[str, Array]:
    """The arrays of a message; lengths of the same letter must be the same."""
    lengths: dict[str, int] = {}
    arrays: dict[str, Array] = {}
    for name, shape in layout.shapes.items():
        raw = body[name]
        if not isinstance(raw, bytes):
            raise _error(kind, type(raw).__name__, "float64 bytes", name=name)
        count, rest = divmod(len(raw), 8 * prod(d for d in shape if isinstance(d, int)))
        symbol = next((d for d in shape if isinstance(d, str)), None)
        expected = 1 if symbol is None else lengths.setdefault(symbol, count)
        if rest or count != expected:
            raise _error(kind, f"{len(raw)} bytes", f"float64 of shape {shape}", name=name)
        array = np.frombuffer(raw, _FLOAT64)
        if name not in layout.infinite and not _all_finite(array):
            cause = "a failed sensor or solver"
            raise _error(kind, "NaN or infinity", "finite numbers", cause, name)
        arrays[name] = array.reshape([count if isinstance(d, str) else d for d in shape])
    return arrays


def _all_finite(array: Array) -> bool:
    return b"\0" not in np.isfinite(array).tobytes()  # half the time of `.all()`


def _check(kind: type[Message], name: str, of: type, each: type, value: Any) -> Any:
    """The checked value of a field that is not an array; `each` is the type of a map's values."""
    if of is int and type(value) is int:
        if 0 <= value < (MAX_TICK if name == "tick" else MAX_INTEGER):
            return value
    elif of is float and type(value) in (int, float) and isfinite(value):
        return float(value)
    elif (of is bool and type(value) is bool) or (
        of is str and isinstance(value, str) and len(value) <= MAX_TEXT
    ):
        return value
    elif of is list and isinstance(value, list):
        return tuple(_check(kind, name, str, str, item) for item in value)
    elif of is dict and isinstance(value, dict):
        return {
            _check(kind, name, str, str, key): _check(kind, name, each, each, item)
            for key, item in value.items()
        }
    raise _error(kind, _describe(value), _EXPECTED[of], name=name)


def _describe(value: Any) -> str:
    """A value of the wire in a few words; `repr` of what nests deeply would overflow the stack."""
    if isinstance(value, (str, bytes)):
        return repr(value[:_MAX_DESCRIPTION])
    if value is None or isinstance(value, (bool, int, float)):
        return repr(value)
    return f"a {type(value).__name__}"


def _error(
    kind: type[Message], got: str, expected: str, cause: str = "", name: str = ""
) -> MessageError:
    label = f"{kind.__name__.lower()}.{name}" if name else kind.__name__.lower()
    return MessageError(label, truncate_text(got, _MAX_DESCRIPTION), expected, cause)
