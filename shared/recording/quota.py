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
MAX_FOREIGN_BYTES: Final = 1 << 28
LONGEST_KEY: Final = 1024  # characters; those of this project have 100 at most

# Reasons for which a message is not stored, as they are noted in a recording, and in words.
OVERSIZED: Final = "oversized"
REFUSED: Final = "refused"
_REASONS: Final[Mapping[str, str]] = {
    OVERSIZED: f"of more than {LARGEST >> 20} MiB",
    REFUSED: "of keys that are not the team's, beyond what is stored of such",
}


class Quota:
    """Decides of each message whether it is stored, and counts those that are not.

    Args:
        is_own: whether a key is the team's: such are always stored; by default all of the table of
            topics.
        largest: payload that is stored, bytes.

    Attributes:
        refused: messages that were not stored, by reason: `OVERSIZED`, or `REFUSED` of what others
            send beyond `MAX_FOREIGN_KEYS` and `MAX_FOREIGN_BYTES`, in all files together.
    """

    def __init__(
        self,
        is_own: Callable[[str], bool] = lambda key: find_topic(key)[0] is not None,
        largest: int = LARGEST,
    ) -> None:
        self.is_own, self._largest = is_own, largest
        self._foreign: set[str] = set()
        self._bytes = 0  # of what others sent
        self.refused: Counter[str] = Counter(dict.fromkeys(_REASONS, 0))

    def admits_key(self, key: str, known: int) -> bool:
        """Whether there is room for a key in a file that has `known` of them; counts if not."""
        own = self.is_own(key)
        room = len(self._foreign) < MAX_FOREIGN_KEYS and len(key) <= LONGEST_KEY
        admitted = known < MAX_KEYS and (own or room or key in self._foreign)
        if admitted and not own:
            self._foreign.add(key)
        self.refused[REFUSED] += not admitted
        return admitted

    def admits_payload(self, size: int, *, own: bool) -> bool:
        """Whether a payload of so many bytes of an admitted key is stored; counts if not."""
        counted = 0 if own else size
        if size > self._largest:
            self.refused[OVERSIZED] += 1
            return False
        if self._bytes + counted > MAX_FOREIGN_BYTES:
            self.refused[REFUSED] += 1
            return False
        self._bytes += counted
        return True


def describe_refused(refused: Mapping[str, int]) -> list[str]:
    """What was not stored, in words, a line for each reason; [] if all was."""
    told = ((refused.get(reason, 0), why) for reason, why in _REASONS.items())
    return [f"{count:,} messages {why}" for count, why in told if count]
