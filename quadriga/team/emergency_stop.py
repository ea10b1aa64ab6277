"""SHELL of the emergency stop: sent at once, or by a process that waits for a key."""

from __future__ import annotations

import os
import select
from typing import Final, Self

from quadriga.drive.stop_proof import unconfirmed
from quadriga.shared import members
from quadriga.shared.codec import truncate_text
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import EStop
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.topics import ESTOP
from quadriga.team.talk import SEARCH, Say, TeamTalk, keep_quiet

_LOOK: Final = 0.005  # s, between two looks at who is there
_ARMED_LOOK: Final = 0.05  # s, likewise, of a process that waits; a key interrupts it
_PATIENCE: Final = 0.5  # s, in which all that hear it must have stopped
_LONG: Final = 0.5  # s, after which the person is told what is waited for
_LONGEST_REASON: Final = 200  # characters; it becomes part of every agent's status
_LINE: Final = 4096  # bytes that are read at once from the keyboard


class EmergencyStop:
    """A link to the team over which it can be stopped; a context.

    Agents can read the stop whatever the reason's text is and whoever else publishes a time.

    Args:
        config: the team's configuration.
        tell: is told who is waited for if that takes long; not before the stop is sent to those
            that hear it, as nothing may hold it up.

    Attributes:
        wanted: agents and plants that are to hear it.

    Raises:
        BusError: the bus cannot be opened.
    """

    def __init__(self, config: Config, tell: Say = keep_quiet) -> None:
        self._tell = tell
        self._talk = TeamTalk(config, members.ESTOP)
        self._plant_each = config.team.plant_per_robot
        self._say = self._talk.publisher(ESTOP)
        self.wanted = self._talk.wanted

    def look(self, timeout: float = 0.0) -> frozenset[str]:
        """Which agents and plants hear this process now, after up to `timeout` seconds."""
        return self._talk.look(timeout)

    def press(self, reason: str) -> None:
        """Stop the team: whoever hears it damps every joint."""
        self._say(EStop(*self._talk.time, truncate_text(reason, _LONGEST_REASON)))

    def press_until_all_heard(self, reason: str) -> str:
        """Stop the team, and again whenever somebody turns up who had been absent.

        Returns:
            What came of it, in a line.

        Raises:
            BusError: some were not there within 5 s, while the others have heard it at once; or
                they were, and have not stopped within 0.5 s.
        """
        self._talk.statuses.clear()
        self._talk.events.clear()
        reached, begun = frozenset[str](), monotonic()
        pressed, told = begun, False
        while reached < self.wanted and monotonic() < begun + SEARCH:
            there = self.look(_LOOK)
            if there and not reached:  # at once, whoever is still absent: they hear it later
                pressed = monotonic()
                self.press(reason)
            reached |= there
            if not told and reached < self.wanted and monotonic() > begun + _LONG:
                told = True
                self._tell(_describe_wait(reached, self.wanted))
        absent = sorted(self.wanted - reached)
        if absent:
            self.press(reason)  # for one who is there but does not say so
            others = ", ".join(sorted(reached)) or "nobody"
            raise self._talk.error(
                "emergency stop",
                f"no {', '.join(absent)} on the bus after {SEARCH:g} s",
                f"all of {', '.join(sorted(self.wanted))}",
                f"sent to {others} at once, no word yet of {', '.join(self._unconfirmed())}; "
                "another bus.endpoint, team.name or team.robots?",
            )
        if not self._talk.follow(lambda: not self._unconfirmed(), _PATIENCE):
            described = self._talk.describe().replace("\n", ", ")
            raise self._talk.error(
                "emergency stop",
                f"no word of {', '.join(self._unconfirmed())} after {_PATIENCE:g} s; {described}",
                "all stopped",
                "cut the power of a robot that moves; `quadriga doctor` tells whether the router "
                "has denied the stop",
            )
        return (
            f"stopped {', '.join(self._talk.agents)} within {1e3 * (monotonic() - pressed):.0f} ms:"
            " every joint is damped, until `quadriga reset`"
        )

    def _unconfirmed(self) -> list[str]:
        """Who has not said yet that it has stopped."""
        talk = self._talk
        return unconfirmed(talk.agents, talk.statuses, talk.events, plant_each=self._plant_each)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._talk.close()


def stop_team(config: Config, reason: str, say: Say, tell: Say = keep_quiet) -> None:
    """Send one emergency stop to every robot of the team.

    Args:
        config: the team's configuration.
        reason: told to every agent.
        say: tells what came of it, in a line, before this process leaves the bus: that takes 2 s
            beside one that is frozen.
        tell: is told who is waited for, if that takes long.

    Raises:
        BusError: the bus cannot be opened, some agents or plants were not reached, or they have
            not stopped.
    """
    with EmergencyStop(config, tell) as stop:
        say(stop.press_until_all_heard(reason))


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
        BusError: the bus cannot be opened, some agents or plants were not reached, or they have
            not stopped.
    """
    with EmergencyStop(config, say) as stop:
        known: frozenset[str] | None = None
        while not select.select([keyboard], [], [], _ARMED_LOOK)[0]:
            there = stop.look()
            if there != known:
                known = there
                say(_describe(there, stop.wanted))
        if not os.read(keyboard, _LINE):
            return False
        say(stop.press_until_all_heard(reason))
    return True


def _describe_wait(reached: frozenset[str], wanted: frozenset[str]) -> str:
    """To whom the stop has been sent, and whom it still has to reach."""
    sent = f"sent to {', '.join(sorted(reached))}" if reached else "nobody hears it yet"
    absent = ", ".join(sorted(wanted - reached))
    return f"emergency stop: {sent}; waiting for {absent}, at most {SEARCH:g} s"


def _describe(there: frozenset[str], wanted: frozenset[str]) -> str:
    """Who would hear an emergency stop now, and who would not."""
    if there == wanted:
        return f"armed: Enter stops {', '.join(sorted(there))}"
    absent = ", ".join(sorted(wanted - there))
    if not there:
        return f"armed, but nobody hears it yet: no {absent}"
    return f"armed: Enter stops {', '.join(sorted(there))}; not there: {absent}"
