"""Real time: a tick every millisecond of the clock, with the latest commands, aged."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from quadriga.plant.attendance import note_absences
from quadriga.plant.deadlines import DAMPED, HELD, PERIOD_MS, Deadlines
from quadriga.plant.end import TOLD_TO_STOP, End
from quadriga.plant.late import FRESH, HOLD, Lateness, hold_joints
from quadriga.plant.pace import TeamPace
from quadriga.plant.server import PlantServer
from quadriga.plant.team_time import plant_gone
from quadriga.shared import codes
from quadriga.shared.bus.session import HERE
from quadriga.shared.messages import Command
from quadriga.shared.runtime.clock import Rate
from quadriga.shared.topics import SAMPLE_MS

TICK: Final = 1e-3  # s
_LOOK_MS: Final = 100  # between two looks at the link to the router
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
        _look_at_others(server, pace)
        end = server.step(motors.commands())
        if server.plant.tick % PERIOD_MS == 0 or end is not None:
            status = motors.deadlines.status(server.plant.tick, rate.overruns)
            status = status if pace is None else pace.describe(status)
            server.publish_status(server.plant.describe(status))
    code, detail = end or TOLD_TO_STOP
    late = motors.deadlines.describe_late()
    return End(code, f"{detail}; late ticks: {late}; overruns of the world: {rate.overruns}")


def _look_at_others(server: PlantServer, pace: TeamPace | None) -> None:
    """See whether agents, the other plants and the link to the router are still there."""
    time, tick = server.time, server.plant.tick
    if tick % _LOOK_MS == 0:
        server.look_at_link()
    if tick % SAMPLE_MS:
        return
    note_absences(server)
    if pace is None or time.end is not None:
        return
    time.look(server.bus.members_at(HERE))
    timeout = server.config.bus.clock_timeout
    if behind := time.behind(tick - round(1000 * timeout)):
        time.end = plant_gone(sorted(behind), f"silent for {timeout:g} s")
    if news := pace.news():
        server.announce(codes.CLOCK_OFF, server.plant.names[0], news)
    if (was_set := pace.look()) is not None:
        time.end = was_set
        if not time.drives:  # who drives time announces the end of the walk, whatever it is
            server.announce(was_set.code, server.plant.names[0], was_set.detail)


class _Motors:
    """The command each motor follows now; `deadlines` counts how late they were."""

    def __init__(self, server: PlantServer) -> None:
        self._server = server
        self._held: dict[str, Command] = {}
        self._lateness = {name: Lateness(server.config.world) for name in server.plant.names}
        self.deadlines = Deadlines(server.plant.names)

    def commands(self) -> dict[str, Command]:
        """By robot; a damped robot is left out."""
        server, tick = self._server, self._server.plant.tick
        chosen = {}
        for name in server.plant.names:
            command = server.commands.latest.get(name)
            age = tick - server.commands.tick_of(name)
            if tick % server.plant.period_ms == 0:
                self.deadlines.note_age(name, age)
            if server.plant.is_robot:
                if command is not None:
                    chosen[name] = command
                continue
            state = self._lateness[name].grade(age)
            server.late_ms[name] = self._lateness[name].late_ms
            if command is not None and state == FRESH:
                chosen[name] = command
                self._held.pop(name, None)
            elif command is None or state == HOLD:
                self.deadlines.late[name, HELD] += 1
                if name not in self._held:
                    self._held[name] = hold_joints(server.plant.states()[name])
                chosen[name] = self._held[name]
            else:
                self.deadlines.late[name, DAMPED] += 1
                self._held.pop(name, None)  # where it was then is no place to go back to
        return chosen
