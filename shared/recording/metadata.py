"""A recording's metadata: their names, and how they are stored, with a version and a checksum."""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping
from typing import Final

from quadriga.shared.errors import NewerRecordingError, RecordingError

RECORDING: Final = "run.mcap"  # in a run folder
PROFILE: Final = "quadriga"  # of the file, and the name of what its writer was given
COUNTS: Final = f"{PROFILE}.counts"  # written at the end: what the writer counted
LOST: Final = f"{PROFILE}.lost"  # by key, messages that did not come
SINCE: Final = f"{PROFILE}.since"  # by key, tick of its first message
END: Final = f"{PROFILE}.end"  # code, detail and tick of an end that nobody announced
FORMAT: Final = 1  # of the recordings that this version writes
_FORMAT_KEY: Final = "format"
_CRC_KEY: Final = "crc32"


def seal(values: Mapping[str, str]) -> dict[str, str]:
    """`values` as they are stored."""
    stored = {**values, _FORMAT_KEY: str(FORMAT)}
    return {**stored, _CRC_KEY: _crc(stored)}


def unseal(stored: Mapping[str, str], name: str) -> dict[str, str]:
    """What `seal` was given; metadata without a trace of a seal are taken as they are.

    Raises:
        NewerRecordingError: a newer format.
        RecordingError: damaged; `name` is the file's.
    """
    values = dict(stored)
    sealed = any(mark in repr(stored) for mark in (f"'{_FORMAT_KEY}'", _CRC_KEY))
    if sealed and values.pop(_CRC_KEY, "") != _crc(values):
        raise RecordingError(
            name,
            "metadata that fail their checksum",
            "metadata as they were written",
            "a damaged file: `quadriga recover` writes what is readable",
        )
    version = values.pop(_FORMAT_KEY, str(FORMAT))
    if version != str(FORMAT):
        raise newer_format_error(name, f"a recording of format {version[:20]}", f"format {FORMAT}")
    return values


def newer_format_error(name: str, got: str, expected: str) -> NewerRecordingError:
    """The error of a file that only a later version of this project can read."""
    return NewerRecordingError(name, got, expected, "recorded by a newer quadriga: update this one")


def _crc(values: Mapping[str, str]) -> str:
    return f"{zlib.crc32(json.dumps(dict(values), sort_keys=True).encode()):08x}"
