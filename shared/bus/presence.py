"""Who of a team is on the bus, and how far: from the tokens that its processes declare."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable

from quadriga.shared.runtime.clock import monotonic


class Presence:
    """The tokens of the other processes, `<team>/<name>/<stage>/<session>`.

    Tokens are noted by the thread that receives them and read by another.
    """

    def __init__(self, session: str) -> None:
        """Begin with nobody; `session` is the own one, which is left out."""
        self._own = session
        self._tokens: set[tuple[str, str, str]] = set()  # name, stage, session

    def note(self, key: str, *, there: bool) -> None:
        """A token has been declared, or has vanished."""
        _, name, stage, session = key.split("/")
        if session == self._own:
            return
        if there:
            self._tokens.add((name, stage, session))
        else:
            self._tokens.discard((name, stage, session))

    def at(self, stage: str) -> frozenset[str]:
        """Names of those that are at `stage` now."""
        return frozenset(self._names(stage))

    def await_all(
        self,
        stage: str,
        names: frozenset[str],
        timeout: float,
        stopped: Callable[[], bool],
        pause: Callable[[], None],
    ) -> frozenset[str] | None:
        """Who of `names` is still not at `stage` after `timeout` seconds; None: `stopped()` first.

        Between two looks `pause()` is called.
        """
        deadline = monotonic() + timeout
        while absent := names - self.at(stage):
            if stopped():
                return None
            if monotonic() > deadline:
                return absent
            pause()
        return frozenset()

    def duplicates(self, stage: str, own: Iterable[str]) -> frozenset[str]:
        """Names that two processes carry at `stage`; `own` is this one's, if it is there."""
        counts = Counter([*self._names(stage), *own])
        return frozenset(name for name, count in counts.items() if count > 1)

    def _names(self, stage: str) -> list[str]:
        return [name for name, at, _ in self._tokens.copy() if at == stage]
