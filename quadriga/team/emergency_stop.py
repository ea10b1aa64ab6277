"""SHELL of the emergency stop: sent at once, or by a process that waits for a key."""

from __future__ import annotations

import os
import select
from collections.abc import Callable
from typing import Final, Self

from quadriga.shared import members
from quadriga.shared.bus.barrier import processes
from quadriga.shared.bus.zenoh_bus import HERE, Bus
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError
from quadriga.shared.members import AGENT, SIM
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.wire.codec import encode, truncate_text
from quadriga.shared.wire.envelope import envelope
from quadriga.shared.wire.messages import EStop
from quadriga.shared.wire.topics import ESTOP, topics_for

_SEARCH: Final = 5.0  # s, longest search for the team
_LOOK: Final = 0.005  # s, between two looks at who is there
_ARMED_LOOK: Final = 0.05  # s, likewise, of a process that waits; a key interrupts it
_LONGEST_REASON: Final = 200  # characters; it becomes part of every agent's status
_LINE: Final = 4096  # bytes that are read at once from the keyboard

Say = Callable[[str], None]


class EmergencyStop:
    """A link to the team over which it can be stopped; a context.

    Agents can read the stop whatever the reason's text is and whoever else publishes a time.

    Args:
        config: the team's configuration.

    Attributes:
        wanted: agents and plants that are to hear it.

    Raises:
        BusError: the bus cannot be opened.
    """

    def __init__(self, config: Config) -> None:
        rows = processes(config)
        self.wanted = frozenset(row.name for row in rows if row.role.name in (AGENT, SIM))
        self._bus = Bus.open(config.bus, config.team.name, members.ESTOP)
        self._put = self._bus.publisher(ESTOP.key(config.team.name), urgent=True)
        for topic in topics_for(members.ESTOP):
            self._bus.subscribe(topic.key(config.team.name))
        self._time = 0, 0  # tick and stamp of the team's clock, as last heard

    def look(self, timeout: float = 0.0) -> frozenset[str]:
        """Which agents and plants hear this process now, after up to `timeout` seconds."""
        first = self._bus.get(timeout)
        for packet in (first, *self._bus.drain()) if first else ():
            self._time = envelope(packet[1]) or self._time
        return self.wanted & self._bus.members_at(HERE)

    def press(self, reason: str) -> None:
        """Stop the team: whoever hears it damps every joint."""
        self._put(encode(EStop(*self._time, truncate_text(reason, _LONGEST_REASON))))

    def press_until_all_heard(self, reason: str) -> None:
        """Stop the team, and again whenever somebody turns up who had been absent.

        Raises:
            BusError: some were not there within 5 s; the others have heard it at once.
        """
        reached, deadline = frozenset[str](), monotonic() + _SEARCH
        while reached < self.wanted and monotonic() < deadline:
            there = self.look(_LOOK)
            if there - reached:  # at once, whoever is still absent: to hear it twice is no harm
                self.press(reason)
                reached |= there
        absent = sorted(self.wanted - reached)
        if absent:
            self.press(reason)  # for one who is there but does not say so
            others = ", ".join(sorted(reached)) or "nobody"
            raise BusError(
                f"emergency stop of team {self._bus.team!r}",
                f"no {', '.join(absent)} on the bus after {_SEARCH:g} s",
                f"all of {', '.join(sorted(self.wanted))}",
                f"{others} heard it at once; another bus.endpoint, team.name or team.robots?",
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._bus.close()


def stop_team(config: Config, reason: str) -> None:
    """Send one emergency stop to every robot of the team.

    Raises:
        BusError: the bus cannot be opened, or some agents or plants were not reached.
    """
    with EmergencyStop(config) as stop:
        stop.press_until_all_heard(reason)


def wait_and_stop(config: Config, reason: str, keyboard: int, say: Say) -> bool:
    """Be ready, say who hears it, and stop the team when Enter is pressed.

    Args:
        config: the team's configuration.
        reason: told to every agent.
        keyboard: file descriptor of the standard input; one line on it stops the team.
        say: tells the operator who hears this process, whenever that changes.

    Returns:
        Whether the team was stopped; False: the keyboard is gone.

    Raises:
        BusError: the bus cannot be opened, or some agents or plants were not reached.
    """
    with EmergencyStop(config) as stop:
        known: frozenset[str] | None = None
        while not select.select([keyboard], [], [], _ARMED_LOOK)[0]:
            there = stop.look()
            if there != known:
                known = there
                say(_describe(there, stop.wanted))
        if not os.read(keyboard, _LINE):
            return False
        stop.press_until_all_heard(reason)
    say(f"stopped: {', '.join(sorted(stop.wanted))}")
    return True


def _describe(there: frozenset[str], wanted: frozenset[str]) -> str:
    """Who would hear an emergency stop now, and who would not."""
    if there == wanted:
        return f"armed: Enter stops {', '.join(sorted(there))}"
    absent = ", ".join(sorted(wanted - there))
    if not there:
        return f"armed, but nobody hears it yet: no {absent}"
    return f"armed: Enter stops {', '.join(sorted(there))}; not there: {absent}"
