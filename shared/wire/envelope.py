"""Tick and stamp of a message, read from its bytes without decoding the rest."""

from __future__ import annotations

from typing import Any, Final

import msgpack

from quadriga.shared.wire.codec import MAX_BYTES, MAX_INTEGER, MAX_TICK

_HEAD: Final = b"\xa6schema\x01\xa4tick"  # what `encode` writes after the map's own byte
_TICK: Final = 1 + len(_HEAD)
_STAMP: Final = b"\xa8stamp_ns"
_WIDTH: Final = {0xCC: 1, 0xCD: 2, 0xCE: 4, 0xCF: 8}  # MessagePack's unsigned integers


def envelope(payload: bytes) -> tuple[int, int] | None:
    """`(tick, stamp_ns)` of a message, or None if its bytes do not carry them.

    Costs about 1 µs for bytes that `wire.codec.encode` wrote, and a full parse for any
    other order of the same fields. Nothing but these two fields is validated, as the codec would.
    """
    if payload[1:_TICK] == _HEAD:
        try:
            tick, end = _read_unsigned(payload, _TICK)
            if payload[end : end + len(_STAMP)] == _STAMP:
                return _check_limits(tick, _read_unsigned(payload, end + len(_STAMP))[0])
        except (IndexError, KeyError):
            pass
    return _parse(payload)


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
