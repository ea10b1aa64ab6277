"""One thing that was looked at, and what came of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

GOOD: Final = "good"
NOTE: Final = "note"  # worth knowing, and nothing is wrong
BAD: Final = "bad"
UNKNOWN: Final = "unknown"  # it could not be looked at


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """What came of one look at a process or a computer.

    Attributes:
        code: what was found or looked at, for programs.
        verdict: `GOOD`, `NOTE`, `BAD` or `UNKNOWN`.
        text: the same in words.
        remedy: what to do about it; "": nothing.
    """

    code: str
    verdict: str
    text: str
    remedy: str = ""
