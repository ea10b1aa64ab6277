"""Real time: a tick every millisecond of the clock, with the latest commands, aged."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from quadriga.plant.commands import CommandTimeout
from quadriga.plant.deadlines import HELD, PERIOD_MS, Deadlines
from quadriga.plant.pace import TeamPace
from quadriga.plant.protocol import TOLD_TO_STOP, End
from quadriga.plant.server import PlantServer
from quadriga.plant.team_time import plant_gone
from quadriga.shared.bus.session import HERE
from quadriga.shared.messages import Command
from quadriga.shared.runtime.clock import Rate
from quadriga.shared.topics import SAMPLE_MS

TICK: Final = 1e-3  # s
_SLACK: Final = 3.0  # ticks that the plant of all robots makes up for


def run_realtime(
    server: PlantServer, stopped: Callable[[], bool], pace: TeamPace | None = None
) -> End:
    """Step until the walk is over; why it is, with what came late.

    Args:
        server: the plant.
        stopped: asked with every tick whether to stop.
        pace: of one of several plants; None: of the plant of all robots.
    """
    # A world that fell behind slows down: in ticks made up for at once nobody could answer.
    rate, motors = pace or Rate(TICK, slack=_SLACK), _Motors(server)
    end: End | None = None
    while end is None and not stopped():
        server.publish()
        motors.deadlines.note_lateness(rate.wait())  # meanwhile the agents answer
        for packet in server.bus.drain():
            server.take(*packet, oldest=0)
        if server.plant.tick % SAMPLE_MS == 0:
            _check_others(server, pace)
        end = server.step(motors.commands())
        if server.plant.tick % PERIOD_MS == 0 or end is not None:
            status = motors.deadlines.status(server.plant.tick, rate.overruns)
            server.publish_status(server.plant.describe(status))
    code, detail = end or TOLD_TO_STOP
    late = motors.deadlines.describe_late()
    return End(code, f"{detail}; late ticks: {late}; overruns of the world: {rate.overruns}")


def _check_others(server: PlantServer, pace: TeamPace | None) -> None:
    """See whether the agents, the other plants and the link to the router are still there."""
    server.check_link()
    present = server.bus.members_at(HERE)
    if not server.plant.is_robot:  # a bridge sees to its robot itself
        server.end_without(set(server.plant.names) - present, "gone")
    if pace is None or server.time.end is not None:
        return
    server.time.look(present)
    timeout = server.config.bus.clock_timeout
    if behind := server.time.behind(server.plant.tick - round(1000 * timeout)):
        server.time.end = plant_gone(
            sorted(behind), f"silent for {timeout:g} s{server.bus.standstill.note}"
        )


class _Motors:
    """The command each motor follows now; `deadlines` counts how late they were."""

    def __init__(self, server: PlantServer) -> None:
        self._server, config = server, server.config
        names = server.plant.names
        self._timeouts = {n: CommandTimeout(config.world, config.gait.stand_ms) for n in names}
        self.deadlines = Deadlines(names)

    def commands(self) -> dict[str, Command]:
        """By robot; of a robot behind a bridge its newest, however late. Ends the walk if lost."""
        server, tick = self._server, self._server.plant.tick
        chosen: dict[str, Command] = {}
        for name, timeout in self._timeouts.items():
            command = server.commands.latest.get(name)
            if tick % server.plant.period_ms == 0:
                self.deadlines.note_age(name, tick - server.commands.tick_of(name))
            if server.plant.is_robot:
                chosen |= {} if command is None else {name: command}
                continue
            chosen[name] = timeout.choose(command, tick, server.plant.states, name)
            self.deadlines.late[name, HELD] += timeout.held is not None
            if why := timeout.describe_loss(command, tick):
                del chosen[name]  # damped
                server.end_without({name}, why)
        return chosen
