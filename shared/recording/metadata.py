"""A recording's metadata: their names, and how they are stored, with a checksum."""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping
from typing import Final

from quadriga.shared.errors import RecordingError

RECORDING: Final = "run.mcap"  # in a run folder
PROFILE: Final = "quadriga"  # of the file, and the name of what its writer was given
COUNTS: Final = f"{PROFILE}.counts"  # written at the end: what the writer counted
LOST: Final = f"{PROFILE}.lost"  # by key, messages that did not come
CHANNELS: Final = f"{PROFILE}.channels"  # sealed: keys by channel, of those that are new here
END: Final = f"{PROFILE}.end"  # code, detail and tick of an end that nobody announced
_FORMAT: Final = "format"
_CRC: Final = "crc32"


def seal(values: Mapping[str, str]) -> dict[str, str]:
    """`values` as they are stored."""
    stored = {**values, _FORMAT: "1"}
    return {**stored, _CRC: _checksum(stored)}


def unseal(stored: Mapping[str, str], name: str) -> dict[str, str]:
    """What `seal` was given; metadata without a trace of a seal are taken as they are.

    Raises:
        RecordingError: damaged; `name` is the file's.
    """
    values = dict(stored)
    sealed = any(mark in repr(stored) for mark in (f"'{_FORMAT}'", _CRC))
    if sealed and values.pop(_CRC, "") != _checksum(values):
        raise RecordingError(
            name,
            "metadata that fail their checksum",
            "metadata as they were written",
            "a damaged file: `quadriga recover` writes what is readable",
        )
    values.pop(_FORMAT, None)
    return values


def _checksum(values: Mapping[str, str]) -> str:
    return f"{zlib.crc32(json.dumps(dict(values), sort_keys=True).encode()):08x}"
