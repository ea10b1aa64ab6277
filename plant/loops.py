"""SHELL of the two ways in which a plant's ticks go on.

In lock-step a tick is taken when every robot's command of that tick is there. In real time states
are sent when a tick begins, every millisecond, commands are due half a tick later, and what has not
come by then is replaced by the latest commands, aged. With a plant for each robot tick k begins
at T0 + k ms by the system clock, which PTP or chrony keeps equal on a team's computers. The plant
that drives time sets T0, which the others read in what it says of itself. From T0 on ticks go by
the monotonic clock, whose rate PTP sets too, so that who sets the system clock moves no tick. Who
is late begins its ticks half a millisecond apart until it is on time: none is left out, and none
comes twice.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from quadriga.plant.commands import CommandTimeout
from quadriga.plant.deadlines import PERIOD_MS, Deadlines
from quadriga.plant.protocol import TOLD_TO_STOP, End
from quadriga.plant.server import NEWER, PlantServer
from quadriga.shared.bus.diagnostics import CLOCK_REMEDY, PACE_LIMIT, clock_difference, lead
from quadriga.shared.bus.discovery import ProcessInfo, ask, ask_clock
from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError
from quadriga.shared.link.connections import CLOSED, NOTHING
from quadriga.shared.members import LEADS, has_lead
from quadriga.shared.messages import Command
from quadriga.shared.runtime.clock import (
    Rate,
    monotonic,
    monotonic_ns,
    sleep,
    wall_ns,
    wall_offset_ns,
)
from quadriga.shared.topics import SAMPLE_MS

TICK: Final = 1e-3  # s
_LOOK_MS: Final = 100  # of world time, between two looks for the router in lock-step
_SLACK: Final = 3.0  # ticks that the plant of all robots makes up for
_TICK_NS: Final = 1_000_000
_DUE: Final = 0.5  # share of a tick after which commands are due
_LEAST_GAP_NS: Final = _TICK_NS // 2  # between the beginnings of two ticks
_AHEAD_NS: Final = 500_000_000  # from when T0 is set: all hear of it meanwhile
_QUIET_NS: Final = 2_000_000  # before T0, in which nothing else is done


def run_lockstep(server: PlantServer, stopped: Callable[[], bool]) -> End:
    """Step until the walk is over; why it is."""
    while not stopped():
        server.publish()
        if server.plant.tick % _LOOK_MS == 0:  # agents on this computer go on without a router
            server.check_link()
        commands = _await_commands(server, stopped)
        if stopped():
            break  # commands may be missing that nobody has lost
        end = server.time.end or server.step(commands)
        if end is not None:
            return end
    return TOLD_TO_STOP


def _await_commands(server: PlantServer, stopped: Callable[[], bool]) -> dict[str, Command]:
    """This tick's commands, by robot in the team's order; ends the walk if one does not come."""
    tick, box = server.plant.tick, server.commands
    patience = server.config.world.command_timeout
    deadline = monotonic() + patience
    # The last to get its state answers last: once it has, the others have too, and are not waited
    # for one by one.
    for name in reversed(server.plant.names):
        while (came := server.receive(name, tick, wait=True)) != NEWER:
            if stopped() or server.time.end is not None:
                return {}
            if came == CLOSED:
                server.end_without({name}, "gone")
            elif monotonic() > deadline:
                server.end_without({name}, f"silent for {patience:g} s")
            elif came == NOTHING:
                server.check_link()
    return {name: box.latest[name] for name in server.plant.names}


class TeamPace:
    """Begins the ticks of one of several plants.

    Args:
        bus: where the others are; this process has met them.
        config: the team's configuration.
        me: what this plant says of itself.

    Attributes:
        overruns: ticks that began late by more than a millisecond.
    """

    def __init__(self, bus: Bus, config: Config, me: ProcessInfo) -> None:
        self._bus, self._config, self._me = bus, config, me
        self._lead = "" if bus.name in LEADS else lead(config)
        self._start = self._tick = self._begun = self.overruns = 0

    def check_clock(self) -> None:
        """Refuse to walk by a system clock that is off.

        Raises:
            BusError: it differs by more than 1 ms from that of the plant that drives time, or that
                does not answer.
        """
        if not self._lead:
            return
        name, answer = f"system clock of {self._bus.name}", ask_clock(self._bus, self._lead)
        if answer is None:
            cause = "it is frozen or overloaded, or has another version of quadriga"
            raise BusError(name, f"no answer of {self._lead}", "its system clock", cause)
        ahead, error = answer.clock_offset
        if off := clock_difference(-ahead, error, PACE_LIMIT):
            got, cause = f"{off} that of {self._lead}", CLOCK_REMEDY
            raise BusError(name, got, f"{1e3 * PACE_LIMIT:g} ms at most", cause)

    def start(self, pause: Callable[[], None], stopped: Callable[[], bool]) -> bool:
        """Wait until T0, once all are ready; False if `stopped()` came first.

        Meanwhile `pause()` is called all the time.

        Raises:
            BusError: the plant that drives time left before it said when the walk begins.
        """
        start = 0
        if not self._lead:
            start = self._me.start_ns = wall_ns() + _AHEAD_NS
        while not start and not stopped():
            if not has_lead(self._bus.members_at(HERE)):
                name, cause = f"{self._lead} of team {self._bus.team!r}", "see what it says itself"
                raise BusError(name, "gone", "it to say when the walk begins", cause)
            for answer in ask(self._bus, (self._lead,), pause).get(self._lead, ()):
                start = start or (answer.about.start_ns if answer.about is not None else 0)
        self._start = start - wall_offset_ns()
        while monotonic_ns() < self._start - _QUIET_NS:
            if stopped():
                return False
            pause()
        sleep(1e-9 * (self._start - monotonic_ns()))
        self._begun = monotonic_ns()
        return not stopped()

    def wait_within(self, share: float) -> None:
        """Wait until a share of a tick has passed since the present one began."""
        sleep(1e-9 * (self._begun + share * _TICK_NS - monotonic_ns()))

    def wait(self) -> float:
        """Wait until the next tick begins; how late it does, s."""
        self._tick += 1
        due = self._start + self._tick * _TICK_NS
        sleep(1e-9 * (max(due, self._begun + _LEAST_GAP_NS) - monotonic_ns()))
        self._begun = monotonic_ns()
        late = max(self._begun - due, 0)
        self.overruns += late > _TICK_NS
        return 1e-9 * late


def run_realtime(
    server: PlantServer, stopped: Callable[[], bool], pace: TeamPace | None = None
) -> End:
    """Step until the walk is over; why it is, with what came late.

    Args:
        server: the plant.
        stopped: asked with every tick whether to stop.
        pace: of one of several plants; None: of the plant of all robots.
    """
    config, names = server.config, server.plant.names
    # A world that fell behind slows down: in ticks made up for at once nobody could answer.
    rate, deadlines = pace or Rate(TICK, slack=_SLACK), Deadlines(names)
    timeouts = {name: CommandTimeout(config.world, config.gait.stand_ms) for name in names}
    end: End | None = None
    while end is None and not stopped():
        server.publish()
        rate.wait_within(_DUE)  # meanwhile the agents answer
        for name in names:
            _take_commands(server, name)
        if server.plant.tick % SAMPLE_MS == 0:
            server.check_link()
            server.time.look(server.bus.members_at(HERE), server.plant.tick)
        end = server.step(_choose_commands(server, timeouts, deadlines))
        if server.plant.tick % PERIOD_MS == 0 or end is not None:
            server.publish_status(deadlines.status(server.plant.tick, rate.overruns))
        deadlines.note_lateness(rate.wait())
    code, detail = end or TOLD_TO_STOP
    late = deadlines.describe_late()
    return End(code, f"{detail}; late ticks: {late}; overruns of the world: {rate.overruns}")


def _take_commands(server: PlantServer, name: str) -> None:
    """Take in what has come of a robot; a bridge sees itself to one whose agent is gone."""
    while (came := server.receive(name, 0, wait=False)) not in (NOTHING, CLOSED):
        pass
    if came == CLOSED and not server.plant.is_robot:
        server.end_without({name}, "gone")


def _choose_commands(
    server: PlantServer, timeouts: Mapping[str, CommandTimeout], deadlines: Deadlines
) -> dict[str, Command]:
    """What each robot's motors follow; ends the walk, and damps, where commands are lost.

    A robot behind a bridge gets its newest command, however late: the bridge sees to that.
    """
    plant, chosen = server.plant, dict[str, Command]()
    for name, timeout in timeouts.items():
        command = server.commands.latest.get(name)
        if plant.is_robot:
            chosen |= {} if command is None else {name: command}
        else:
            chosen[name] = timeout.choose(command, plant.tick, plant.states, name)
            if why := timeout.describe_loss(command, plant.tick):
                del chosen[name]
                server.end_without({name}, why)
        if plant.tick % plant.period_ms == 0:
            age = plant.tick - server.commands.tick_of(name)
            deadlines.note_command(name, age, held=timeout.held is not None)
    return chosen
