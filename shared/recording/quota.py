"""What of a team's traffic is stored: all of its own, and of what others send as much as fits."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from typing import Final

from quadriga.shared.codec import MAX_BYTES
from quadriga.shared.topics import find_topic

LARGEST: Final = MAX_BYTES  # bytes of a payload: a larger one is no message to anybody
MAX_KEYS: Final = 32_768  # of a file: its format counts them with 16 bits
MAX_FOREIGN_KEYS: Final = 4096
LONGEST_KEY: Final = 1024  # characters; those of this project have 100 at most

# Reasons for which a message is not stored, as they are noted in a recording, and in words.
OVERSIZED: Final = "oversized"
REFUSED: Final = "refused"
_REASONS: Final[Mapping[str, str]] = {
    OVERSIZED: f"of more than {LARGEST >> 20} MiB",
    REFUSED: "of keys that are not the team's, beyond what is stored of such",
}


class Quota:
    """Decides of each key whether it is stored, and counts messages that are not.

    Args:
        is_own: whether a key is the team's: such are always stored; by default all of the table of
            topics.
        largest: payload that is stored, bytes.

    Attributes:
        refused: messages that were not stored, by reason: `OVERSIZED`, or `REFUSED` of what others
            send beyond `MAX_FOREIGN_KEYS`, in all files together.
    """

    def __init__(
        self,
        is_own: Callable[[str], bool] = lambda key: find_topic(key)[0] is not None,
        largest: int = LARGEST,
    ) -> None:
        self.largest, self._is_own = largest, is_own
        self._foreign: set[str] = set()
        self.refused: Counter[str] = Counter(dict.fromkeys(_REASONS, 0))

    def admits(self, key: str, known: int) -> bool:
        """Whether there is room for a key in a file that has `known` of them."""
        if known >= MAX_KEYS:
            return False
        if self._is_own(key) or key in self._foreign:
            return True
        room = len(self._foreign) < MAX_FOREIGN_KEYS and len(key) <= LONGEST_KEY
        if room:
            self._foreign.add(key)
        return room


def describe_refused(refused: Mapping[str, int]) -> list[str]:
    """What was not stored, in words, a line for each reason; [] if all was."""
    told = ((refused.get(reason, 0), why) for reason, why in _REASONS.items())
    return [f"{count:,} messages {why}" for count, why in told if count]
