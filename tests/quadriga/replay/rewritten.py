"""Recordings with something planted in them or taken out."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

import msgpack

from quadriga.shared.recording.reader import ChunkEntry, Recording
from quadriga.shared.recording.writer import RecordingWriter

BIN8: Final = 0xC4
Edit = Callable[[ChunkEntry], bytes | None]


def rewritten(
    source: Path,
    target: Path,
    edit: Edit = lambda entry: entry.payload,
    config: Mapping[str, Any] | None = None,
    metadata: Mapping[str, str] | None = None,
) -> Path:
    """A copy of a recording.

    Args:
        source: the recording.
        target: the copy.
        edit: gives each message's payload in the copy, None to leave it out.
        config: values by `section.key` that the copy claims to be configured with.
        metadata: other metadata it claims.
    """
    recording = Recording(source)
    sections = json.loads(recording.metadata["config_json"])
    for name, value in (config or {}).items():
        section, _, key = name.partition(".")
        sections[section][key] = value
    about = {**recording.metadata, "config_json": json.dumps(sections), **(metadata or {})}
    with RecordingWriter(target, about) as to:
        for entry in recording.entries():
            payload = edit(entry)
            if payload is not None:
                to.write(entry.key, payload, entry.log_time_ns)
    return target


def without(key: str, tick: int) -> Edit:
    """Leave out one message."""
    return lambda entry: None if (entry.key, entry.tick) == (key, tick) else entry.payload


def planted_bit(key: str, tick: int, name: str) -> Edit:
    """Flip one bit in the first number that is not zero of one field of one message.

    It is the lowest bit of the double's third highest byte: a change of about 1 in 2^12.
    """

    def edit(entry: ChunkEntry) -> bytes:
        if (entry.key, entry.tick) != (key, tick):
            return entry.payload
        payload = bytearray(entry.payload)
        place = payload.index(msgpack.packb(name)) + 1 + len(name)
        place += 2 if payload[place] == BIN8 else 3  # how the bytes and their number are written
        while payload[place : place + 8] == bytes(8):
            place += 8
        payload[place + 5] ^= 1
        return bytes(payload)

    return edit
