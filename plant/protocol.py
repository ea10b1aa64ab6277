"""What a plant is: the robots of a team, simulated or real, as the plant server drives them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Final, NamedTuple, Protocol

from quadriga.shared import codes
from quadriga.shared.errors import ConfigError
from quadriga.shared.messages import Command, Event, State, Status, Truth


class End(NamedTuple):
    """Why a walk is over: a code of `quadriga.shared.codes.EVENTS`, and prose."""

    code: str
    detail: str


TOLD_TO_STOP: Final = End(codes.SIGNAL, "signal")


class Plant(Protocol):
    """Robots that are measured and commanded once a tick of 1 ms.

    A class that has it as its base need not define more than `states` and `step`.

    Attributes:
        names: of the robots, in the order of every stacked array.
        tick: world time that has passed, ms.
        is_robot: whether it is a real robot. That stands up once the agents are ready, is attended
            to all the time, and sees to late commands itself: it gets the newest, however old.
        period_ms: between two ticks at which it is commanded.
    """

    names: tuple[str, ...]
    tick: int
    is_robot: bool = False
    period_ms: int = 1

    def prepare(self, stopped: Callable[[], bool]) -> bool:
        """Get the robots to stand, before the team walks; False if `stopped()` came first."""
        return not stopped()

    def listen(self, estops: Callable[[], str], announce: Callable[[Event], None]) -> None:
        """Ask `estops()` from now on why the team's emergency stop was pressed; "" if it was not.

        Agents hear it too, but no robot may depend on them; for other plants the server sees to it.
        What a robot does goes to `announce`, also while it stands up before the walk.
        """
        return

    def idle(self) -> None:
        """Let a millisecond pass, while a robot that stands waits for the others."""
        return

    def finish(self) -> None:
        """Bring the robots to rest, after the walk."""
        return

    def describe(self, status: Status) -> Status:
        """The plant server's report on itself, with what this plant has to say."""
        return status

    def states(self) -> Mapping[str, State]:
        """What each robot measures at this tick, by name."""
        ...

    def step(self, commands: Mapping[str, Command]) -> Sequence[Event]:
        """Drive the motors for one tick and return what happened in it.

        A robot without a command damps its joints.
        """
        ...

    def inject(self, fault: str) -> Sequence[Event]:
        """Make a sensor or motor faulty soon, as `world.faults` describes it without its time.

        Returns:
            What is to be announced of it.

        Raises:
            ConfigError: that cannot be done.
        """
        cause = "no sensor or motor of a real robot is made faulty on purpose"
        raise ConfigError("fault", repr(fault), "a simulated world", cause)

    def expect_down(self, stopped: Collection[str]) -> None:
        """Hear which robots an emergency stop damps now: until they are up again none falls."""
        return

    def truth(self) -> Truth | None:
        """The true state at this tick; None of a plant that does not know it."""
        return None

    def settle(self) -> None:
        """Work that needs no command, while those of this tick are awaited."""
        return
