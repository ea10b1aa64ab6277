"""What a plant is: the robots of a team, simulated or real, as the plant server drives them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from quadriga.shared.wire.messages import Command, Event, State, Truth


class Plant(Protocol):
    """Robots that are measured and commanded once a tick of 1 ms.

    A class that has it as its base need not define `truth` and `settle`.

    Attributes:
        names: of the robots, in the order of every stacked array.
        tick: world time that has passed, ms.
    """

    names: tuple[str, ...]
    tick: int

    def states(self) -> Mapping[str, State]:
        """What each robot measures at this tick, by name."""
        ...

    def step(self, commands: Mapping[str, Command]) -> Sequence[Event]:
        """Drive the motors for one tick and return what happened in it.

        A robot without a command damps its joints.
        """
        ...

    def truth(self) -> Truth | None:
        """The true state at this tick; None of a plant that does not know it."""
        return None

    def settle(self) -> None:
        """Work that needs no command, while those of this tick are awaited."""
