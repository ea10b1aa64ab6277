"""A message as one line that a person can read."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, Final

import numpy as np

from quadriga.shared.codec import decode
from quadriga.shared.errors import MessageError
from quadriga.shared.printable import printable_line
from quadriga.shared.recording.reader import ChunkEntry
from quadriga.shared.topics import topic_of

_SHORT: Final = 4  # numbers of an array that are shown
_BYTES: Final = 24  # of what is no message
_ENVELOPE: Final = ("tick", "stamp_ns")


def format_entry(entry: ChunkEntry, *, full: bool = False) -> str:
    """World time, key and every field; long arrays are cut unless `full`."""
    when = f"{entry.tick / 1000:9.3f} s" if entry.tick >= 0 else f"{'–':>9}  "
    return printable_line(f"{when}  {entry.key}  {_format_content(entry, full)}")


def _format_content(entry: ChunkEntry, full: bool) -> str:
    try:
        message = decode(entry.payload, topic_of(entry.key)[0].type)
    except MessageError as error:
        shown = entry.payload[:_BYTES].hex(" ")
        more = "" if len(entry.payload) <= _BYTES else " …"
        return f"{len(entry.payload)} bytes, {error.name} is {error.got}: {shown}{more}"
    return " ".join(
        f"{item.name}={_format_value(getattr(message, item.name), full)}"
        for item in fields(message)
        if item.name not in _ENVELOPE
    )


def _format_value(value: Any, full: bool) -> str:
    if isinstance(value, np.ndarray):
        flat = value.ravel()
        shown = flat if full else flat[:_SHORT]
        shape = f"{'×'.join(map(str, value.shape))}:" if value.ndim > 1 else ""
        more = f" … {len(flat)}" if len(shown) < len(flat) else ""
        return f"[{shape}{' '.join(_format_number(x) for x in shown)}{more}]"
    if isinstance(value, float):
        return _format_number(value)
    if isinstance(value, str):
        return repr(value)
    if isinstance(value, tuple):
        return f"[{' '.join(map(str, value))}]"
    if isinstance(value, int):
        return str(value)
    return "{" + " ".join(f"{k}:{_format_value(v, full)}" for k, v in value.items()) + "}"


def _format_number(value: float) -> str:
    return f"{value:.4g}"
