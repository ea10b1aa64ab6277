"""Tells, while a process waits at the barrier, for whom it waits and why they are not there."""

from __future__ import annotations

import sys
from collections.abc import Collection
from typing import Final

from quadriga.shared.bus.absence import describe_absent
from quadriga.shared.bus.inquiry import Pause, ask, view_of
from quadriga.shared.bus.introduction import describe_process
from quadriga.shared.bus.roster import processes
from quadriga.shared.bus.trust import describe_way
from quadriga.shared.bus.zenoh_bus import Bus
from quadriga.shared.config.sections import Config
from quadriga.shared.runtime.clock import monotonic

_QUIET: Final = 2.0  # s of waiting that need no word
_EVERY: Final = 5.0  # s, between two looks at those that are awaited


def say(text: str) -> None:
    """Tell whoever reads this process's log."""
    print(f"quadriga: {text}", file=sys.stderr, flush=True)


class Watch:
    """Looks at those that are awaited from time to time.

    Args:
        bus: of the process that waits.
        config: its configuration.
        stage: at which they are awaited.
        names: who they are.
        wait: takes some milliseconds.
    """

    def __init__(
        self, bus: Bus, config: Config, stage: str, names: Collection[str], wait: Pause
    ) -> None:
        self._bus, self._config, self._stage, self._names = bus, config, stage, frozenset(names)
        self._wait, self._said, self._due = wait, "", monotonic() + _QUIET

    def pause(self) -> None:
        """Let some milliseconds pass; when it takes long, say who is awaited, if that is news."""
        self._wait()
        if monotonic() < self._due:
            return
        absent = self._names - {self._bus.name} - self._bus.members_at(self._stage)
        reasons = self._describe(absent)[0] if absent else self._said
        if reasons != self._said:
            self._said = reasons
            say(f"{self._bus.name} waits; {reasons}")
        self._due = monotonic() + _EVERY

    def explain(self, absent: Collection[str]) -> str:
        """Why some are not there, in one line; takes a second if one of those there is frozen."""
        reasons, linked = self._describe(absent)
        # Only now, at the end: to try it may take a second in which a robot would not be attended.
        return reasons if linked else f"{reasons}; {describe_way(self._config.bus, self._bus.name)}"

    def _describe(self, absent: Collection[str]) -> tuple[str, bool]:
        """Why some are not there, and whether this process is linked to anybody."""
        bus, config = self._bus, self._config
        view = view_of(bus, config, ask(bus, wait=self._wait), describe_process(config, bus.name))
        waited = [member for member in processes(config) if member.name in absent]
        return describe_absent(waited, view), view.linked
