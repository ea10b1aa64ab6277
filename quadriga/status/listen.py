"""SHELL: hears a team without being one of it, and looks at its processes on this computer."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from quadriga.doctor.health import WELL, judge_team
from quadriga.doctor.watch_team import WalkEnd
from quadriga.shared.bus.diagnostics import TeamView, processes
from quadriga.shared.bus.discovery import ask, describe_process, view_of
from quadriga.shared.bus.session import HERE, Arrival, Bus
from quadriga.shared.codec import envelope
from quadriga.shared.config.sections import Config
from quadriga.shared.link.ticks import gathered
from quadriga.shared.members import OBSERVER
from quadriga.shared.runtime.clock import monotonic, monotonic_ns, sleep
from quadriga.shared.runtime.process_use import read_use
from quadriga.shared.topics import TABLE, TICKS
from quadriga.status.gather import StatusFold
from quadriga.status.judge import find_problems
from quadriga.status.record import MachineUse, MemberStatus, TeamStatus

_ASK_EVERY: Final = 5.0  # s between two questions, each of which costs every process an answer
_LINK_TIMEOUT: Final = 3.0  # s, in which a link to those that are there has come about
_PAUSE: Final = 0.05  # s between two looks at what has come


class TeamListener:
    """A look at a team again and again.

    Args:
        config: the team's configuration.
        bus: opened with a name of those who only look on.
        every_topic: hear states and commands too, 1000 a second of each robot.
    """

    def __init__(self, config: Config, bus: Bus, *, every_topic: bool) -> None:
        self._config, self._bus = config, bus
        self._team = processes(config)
        self._fold, self._end = StatusFold(config), WalkEnd(bus)
        self._every_topic = every_topic
        keys = {topic.key(bus.team, "*") for topic in TABLE if every_topic or topic is not TICKS}
        self._takes: list[Callable[[], list[Arrival]]] = [
            bus.collect(key) for key in sorted(keys) if not _is_covered(key, keys)
        ]
        self._view: TeamView | None = None
        self._asked = 0.0
        self._uses: dict[int, tuple[float, float]] = {}  # by process: when, and its time by then

    @property
    def is_over(self) -> bool:
        """Whether the walk that was seen is over, or nobody can be seen any more."""
        return self._end.is_over()

    def hear(self, seconds: float, stopped: Callable[[], bool]) -> None:
        """Listen for a while, or until `stopped()`."""
        until = monotonic() + seconds
        while not stopped() and monotonic() < until:
            sleep(min(_PAUSE, max(until - monotonic(), 0.0)))
            arrived = [arrival for take in self._takes for arrival in take()]
            for at_ns, key, payload in sorted(arrived, key=lambda arrival: arrival[0]):
                head = envelope(payload)
                self._fold.add(key, payload, -1 if head is None else head[0], at_ns)
                for item in gathered(key, payload) if _is_batch(key) else ():
                    self._fold.add(item.key, item.payload, item.tick, at_ns)

    def look(self) -> TeamStatus:
        """How the team is now, by what was heard since the last look."""
        bus, config = self._bus, self._config
        view = self._view
        if view is None or not view.linked or monotonic() - self._asked > _ASK_EVERY:
            self._asked = monotonic()
            view = view_of(bus, config, ask(bus), describe_process(config, OBSERVER))
            self._view = view
        here = bus.members_at(HERE)
        health = judge_team(self._team, view)
        reading = self._fold.look(monotonic_ns())

        def gone(name: str) -> bool:
            """Whether a process has gone since all were asked."""
            return name not in here and health[name] == WELL

        members = tuple(
            MemberStatus(
                member.name,
                member.name in here,
                "not well: gone" if gone(member.name) else health[member.name],
                self._use_of(view, member.name),
                reading.accounts.get(member.name),
            )
            for member in self._team
        )
        problems = find_problems(config, bus.linked, reading, members)
        name, endpoint = config.team.name, config.bus.endpoint
        return TeamStatus(name, endpoint, bus.linked, reading, members, problems)

    def _use_of(self, view: TeamView, name: str) -> MachineUse | None:
        about = view.about(name)
        if about is None:
            return None
        use = read_use(about.pid) if about.host == socket.gethostname() else None
        if use is None or not _is_quadriga(about.pid):
            return MachineUse(about.host, about.pid)
        now = monotonic()
        before = self._uses.get(about.pid)
        self._uses[about.pid] = now, use.cpu_s
        cpu = None if before is None else (use.cpu_s - before[1]) / max(now - before[0], 1e-3)
        return MachineUse(about.host, about.pid, cpu, use.memory)


@contextmanager
def listening(
    config: Config, name: str, stopped: Callable[[], bool], *, every_topic: bool = False
) -> Iterator[TeamListener]:
    """A listener that has a link to the team, if there is one.

    Args:
        config: the team's configuration.
        name: of the command that looks on.
        stopped: asked often whether to stop.
        every_topic: see `TeamListener`.

    Raises:
        BusError: the bus cannot be opened.
    """
    with Bus.open(config.bus, config.team.name, f"{name}-{os.getpid()}", stopped) as bus:
        listener = TeamListener(config, bus, every_topic=every_topic)
        bus.wait_for_link(_LINK_TIMEOUT, stopped)
        yield listener


def _is_batch(key: str) -> bool:
    return key.endswith(f"/{TICKS.name}")


def _is_covered(key: str, keys: Collection[str]) -> bool:
    """Whether another of these expressions hears the same, as `t/*/event` does `t/sim/event`."""
    parts = key.split("/")
    others = (other.split("/") for other in keys if other != key)
    return any(
        len(other) == len(parts) and all(o in ("*", p) for o, p in zip(other, parts, strict=True))
        for other in others
    )


def _is_quadriga(pid: int) -> bool:
    """Whether it is one of this project's: a container may have the same host name and numbers."""
    try:
        return b"quadriga" in (Path("/proc") / str(pid) / "cmdline").read_bytes()
    except OSError:
        return False
