"""Bytes ↔ messages: MessagePack maps, arrays as little-endian float64; all wire validation."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import cache, partial
from math import isfinite, prod
from typing import Any, Final, TypeVar

import msgpack
import numpy as np
from numpy.typing import NDArray

from quadriga.shared.errors import MessageError
from quadriga.shared.messages import Flat, Message, cuts_of
from quadriga.shared.robots.conventions import Array

M = TypeVar("M", bound=Message)

MAX_BYTES = 1 << 20  # a message larger than this is refused before it is parsed
MAX_TICK = 1 << 42  # 139 years of ms, so that a tick in ns is still an integer of the wire
MAX_INTEGER = 1 << 62  # integers of all other fields are below
MAX_TEXT = 4096  # characters
# Characters of what is wrong with a message: errors become events and log lines.
_MAX_DESCRIPTION: Final = 120
_ENVELOPE: Final = ("tick", "stamp_ns")
_FLOAT64: Final = np.dtype("<f8")
_HEAD: Final = b"\xa6schema\x01\xa4tick"  # what `encode` writes after the map's own byte
_TICK_AT: Final = 1 + len(_HEAD)
_STAMP: Final = b"\xa8stamp_ns"
_WIDTH: Final = {0xCC: 1, 0xCD: 2, 0xCE: 4, 0xCF: 8}  # MessagePack's unsigned integers
Bytes = NDArray[np.uint8]
Read = Callable[[Bytes, Bytes, Bytes, Bytes, Array, Array], tuple[int, int]]
_TICK: Final = b"\xa4tick"  # MessagePack's text of four bytes
_STAMP_BYTES: Final = np.frombuffer(_STAMP, np.uint8)


def encode(message: Message) -> bytes:
    """The wire form of a message. Equal messages give equal bytes. Nothing is checked."""
    layout = _layout(type(message))
    if isinstance(message, Flat) and layout.flat is not None:
        return layout.flat.write(message.tick, message.stamp_ns, message.row)
    body: dict[str, Any] = {"schema": message.SCHEMA}
    for name in layout.plain:
        body[name] = getattr(message, name)
    for name in layout.shapes:
        body[name] = np.ascontiguousarray(getattr(message, name), dtype="<f8").tobytes()
    packed: bytes = msgpack.packb(body)
    return packed


def truncate_text(text: str, limit: int = MAX_TEXT) -> str:
    """`text` as a message may hold it: cut to `limit` characters, a `?` for what UTF-8 cannot say.

    What was typed in a terminal of another encoding holds such characters.
    """
    text = text if len(text) <= limit else f"{text[: limit - 1]}…"
    return text.encode("utf-8", "replace").decode("utf-8")


def decode(payload: bytes, kind: type[M]) -> M:
    """The message of type `kind` in `payload`; its arrays are read-only views.

    Raises:
        MessageError: not MessagePack, wrong schema version, fields missing or unknown,
            wrong type or shape, or a number that is not finite.
    """
    layout = _layout(kind)
    if layout.flat is not None and (fields := layout.flat.read(payload)) is not None:
        tick, stamp_ns, row = fields
        if tick < MAX_TICK:
            made: M = layout.from_row(tick, stamp_ns, row)
            return made
    if len(payload) > MAX_BYTES:
        raise _error(kind, f"{len(payload)} bytes", f"at most {MAX_BYTES}", "a foreign publisher?")
    try:
        body = msgpack.unpackb(payload)
    except (ValueError, TypeError, msgpack.exceptions.UnpackException) as error:
        raise _error(
            kind,
            f"{len(payload)} bytes that do not parse ({error})",
            "a MessagePack map",
            "truncated or corrupt message",
        ) from None
    if not isinstance(body, dict):
        raise _error(kind, type(body).__name__, "a MessagePack map", "a foreign publisher?")
    schema = body.pop("schema", None)
    if schema != kind.SCHEMA or isinstance(schema, bool):
        raise _error(
            kind,
            f"schema {_describe(schema)}",
            f"schema {kind.SCHEMA}",
            "another version of quadriga",
        )
    if tuple(body) != layout.order and body.keys() != layout.names:
        missing = sorted(layout.names - body.keys())
        unknown = sorted(str(key) for key in body.keys() - layout.names)
        raise _error(kind, f"{missing=} {unknown=}", "exactly the fields of the type", "")
    arrays = _arrays(kind, layout.shapes, body)
    plain = [check(body[name]) for name, check in layout.plain.items()]
    if layout.in_order:
        return kind(*plain, *arrays)
    values = zip(layout.order, (*plain, *arrays), strict=True)
    return kind(**dict(values))


def envelope(payload: bytes) -> tuple[int, int] | None:
    """`(tick, stamp_ns)` of a message, or None if its bytes do not carry them.

    Costs about 1 µs for bytes that `shared.codec.encode` wrote, and a full parse for any
    other order of the same fields. Nothing but these two fields is validated, as the codec would.
    """
    if payload[1:_TICK_AT] == _HEAD:
        try:
            tick, end = _read_unsigned(payload, _TICK_AT)
            if payload[end : end + len(_STAMP)] == _STAMP:
                return _check_limits(tick, _read_unsigned(payload, end + len(_STAMP))[0])
        except (IndexError, KeyError):
            pass
    return _parse(payload)


def _arrays(kind: type[Message], shapes: Mapping[str, Any], body: dict[str, Any]) -> list[Array]:
    lengths: dict[str, int] = {}
    arrays = []
    for name, shape in shapes.items():
        raw = body[name]
        if not isinstance(raw, bytes):
            raise _error(kind, type(raw).__name__, "float64 bytes", "", name)
        fixed = 8 * prod(d for d in shape if isinstance(d, int))
        count, rest = divmod(len(raw), fixed)
        symbol = next((d for d in shape if isinstance(d, str)), None)
        expected = 1 if symbol is None else lengths.setdefault(symbol, count)
        if rest or count != expected:
            raise _error(kind, f"{len(raw)} bytes", f"float64 of shape {shape}", "", name)
        array = np.frombuffer(raw, _FLOAT64)
        if not _all_finite(array):
            raise _error(
                kind, "NaN or infinity", "finite numbers", "a failed sensor or solver", name
            )
        arrays.append(array.reshape([count if isinstance(d, str) else d for d in shape]))
    return arrays


def _all_finite(array: Array) -> bool:
    return b"\0" not in np.isfinite(array).tobytes()  # half the time of `.all()`


class _Layout:
    """What the codec must know of one message type, computed once."""

    def __init__(self, kind: type[Message]) -> None:
        self.shapes: dict[str, tuple[int | str, ...]] = {}
        self.plain: dict[str, Callable[[Any], Any]] = {}
        for item in fields(kind):
            if "shape" in item.metadata:
                self.shapes[item.name] = item.metadata["shape"]
            else:
                self.plain[item.name] = _checker(kind, item.name, item.metadata["kind"], item.type)
        self.order = (*self.plain, *self.shapes)  # as `encode` writes them
        self.names = {*self.order}
        self.in_order = self.order == tuple(item.name for item in fields(kind))
        sizes = {name: shape[0] for name, shape in self.shapes.items() if len(shape) == 1}
        fixed = {name: size for name, size in sizes.items() if isinstance(size, int)}
        self.flat: FlatLayout | None = None
        self.from_row: Callable[
            [int, int, Array], Any
        ]  # makes a message of a row, if there is `flat`
        if fixed and fixed.keys() == self.shapes.keys() and tuple(self.plain) == _ENVELOPE:
            cuts = cuts_of(fixed)
            self.flat = FlatLayout(kind.SCHEMA, cuts)
            self.from_row = (
                kind.from_row if issubclass(kind, Flat) else partial(_from_row, kind, cuts)
            )


def _from_row(
    kind: type[Message], cuts: Mapping[str, slice], tick: int, stamp_ns: int, row: Array
) -> Message:
    row.setflags(write=False)
    arrays: Any = {name: row[cut] for name, cut in cuts.items()}
    return kind(tick, stamp_ns, **arrays)


_LAYOUTS: dict[type[Message], _Layout] = {}


def _layout(kind: type[Message]) -> _Layout:
    layout = _LAYOUTS.get(kind)
    if layout is None:
        layout = _LAYOUTS[kind] = _Layout(kind)
    return layout


def _checker(kind: type[Message], name: str, of: type, annotation: Any) -> Callable[[Any], Any]:
    """A function that returns the checked value of a field that is not an array."""

    def wrong(value: Any, expected: str) -> MessageError:
        return _error(kind, _describe(value), expected, "", name)

    limit = MAX_TICK if name == "tick" else MAX_INTEGER

    def integer(value: Any) -> int:
        if type(value) is not int or not 0 <= value < limit:
            raise wrong(value, f"an integer ≥ 0 and below {limit}")
        return value

    def number(value: Any) -> float:
        if type(value) not in (int, float) or not isfinite(value):
            raise wrong(value, "a finite number")
        return float(value)

    def text(value: Any) -> str:
        if not isinstance(value, str) or len(value) > MAX_TEXT:
            raise wrong(value, f"text of at most {MAX_TEXT} characters")
        return value

    def truth(value: Any) -> bool:
        if type(value) is not bool:
            raise wrong(value, "true or false")
        return value

    def names(value: Any) -> tuple[str, ...]:
        if not isinstance(value, list):
            raise wrong(value, "a list of text")
        return tuple(text(item) for item in value)

    def mapping(value: Any) -> Mapping[str, Any]:
        if not isinstance(value, dict):
            raise wrong(value, "a map")
        each = integer if "int" in str(annotation) else number
        return {text(key): each(item) for key, item in value.items()}

    checks: dict[type, Callable[[Any], Any]] = {
        bool: truth,
        int: integer,
        float: number,
        str: text,
        list: names,
        dict: mapping,
    }
    return checks[of]


def _describe(value: Any) -> str:
    """A value of the wire in a few words; `repr` of what nests deeply would overflow the stack."""
    if isinstance(value, (str, bytes)):
        return repr(value[:_MAX_DESCRIPTION])
    if value is None or isinstance(value, (bool, int, float)):
        return repr(value)
    return f"a {type(value).__name__}"


def _error(
    kind: type[Message], got: str, expected: str, cause: str, name: str = ""
) -> MessageError:
    label = f"{kind.__name__.lower()}.{name}" if name else kind.__name__.lower()
    return MessageError(label, truncate_text(got, _MAX_DESCRIPTION), expected, cause)


def _read_unsigned(payload: bytes, at: int) -> tuple[int, int]:
    first = payload[at]
    if first < 0x80:
        return first, at + 1
    end = at + 1 + _WIDTH[first]
    if end > len(payload):
        raise IndexError(end)
    return int.from_bytes(payload[at + 1 : end], "big"), end


def _parse(payload: bytes) -> tuple[int, int] | None:
    if len(payload) > MAX_BYTES:  # nobody's message, and parsed it may take a hundredfold
        return None
    try:
        body: Any = msgpack.unpackb(payload)
    except (ValueError, TypeError, msgpack.exceptions.UnpackException):
        return None
    if not isinstance(body, dict):
        return None
    tick, stamp_ns = body.get("tick"), body.get("stamp_ns")
    if type(tick) is not int or type(stamp_ns) is not int:
        return None
    return _check_limits(tick, stamp_ns)


def _check_limits(tick: int, stamp_ns: int) -> tuple[int, int] | None:
    return (tick, stamp_ns) if 0 <= tick < MAX_TICK and 0 <= stamp_ns < MAX_INTEGER else None


class FlatLayout:
    """Where a type keeps what on the wire, if its numbers are all in one row.

    The bytes of two such messages of one type differ in three things only: tick, stamp and numbers.
    So one compiled pass compares the rest with a template and takes the numbers out. At 1 kHz a
    general parser is dear not for what it computes but for all the code it goes through with cold
    caches.

    Args:
        schema: its version.
        cuts: where each field's numbers are in the row, in the order of the wire.
    """

    def __init__(self, schema: int, cuts: Mapping[str, slice]) -> None:
        self._cuts = [slice(8 * cut.start, 8 * cut.stop) for cut in cuts.values()]  # bytes
        zeros = {name: bytes(8 * (cut.stop - cut.start)) for name, cut in cuts.items()}
        whole: bytes = msgpack.packb({"schema": schema, "tick": 0, "stamp_ns": 0, **zeros})
        cut = whole.index(_TICK) + len(_TICK)
        self._head, tail = whole[:cut], whole[cut + 1 + len(_STAMP) + 1 :]
        self._head_bytes = np.frombuffer(self._head, np.uint8)
        self._tail_bytes = np.frombuffer(tail, np.uint8)
        self._size = max(cut.stop for cut in cuts.values())
        self._names: list[bytes] = []  # what precedes the numbers of each field
        spans, at = [], 0  # where those begin in the tail, how many bytes they are
        for name, raw in zeros.items():
            start = at + len(msgpack.packb({name: raw})) - 1 - len(raw)
            self._names.append(tail[at:start])
            at = start + len(raw)
            spans.append((start, len(raw)))
        self._spans = np.array(spans)

    def write(self, tick: int, stamp_ns: int, row: Array) -> bytes:
        """The message's bytes, those of MessagePack."""
        raw = np.ascontiguousarray(row, "<f8").tobytes()
        parts = [self._head, msgpack.packb(tick), _STAMP, msgpack.packb(stamp_ns)]
        for name, cut in zip(self._names, self._cuts, strict=True):
            parts += (name, raw[cut])
        return b"".join(parts)

    def read(self, payload: bytes) -> tuple[int, int, Array] | None:
        """Tick, stamp and row, or None of anything but what `write` gives for finite numbers.

        None is no judgement: the same fields in another order, for example, are a valid message.
        """
        row = np.empty(self._size)
        tick, stamp_ns = _compiled_read()(
            np.frombuffer(payload, np.uint8),
            self._head_bytes,
            _STAMP_BYTES,
            self._tail_bytes,
            self._spans,
            row,
        )
        return None if tick < 0 else (tick, stamp_ns, row)


@cache
def _compiled_read() -> Read:
    """The pass over the bytes. Only who reads such messages waits until the compiler is imported.

    Operator, recorder, router and emergency stop do not.
    """
    from quadriga.shared.flat_bytes import read_flat

    return read_flat
