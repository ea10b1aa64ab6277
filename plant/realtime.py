"""Real time: a tick every millisecond of the clock, with the latest commands, aged."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from quadriga.plant.commands import CommandTimeout
from quadriga.plant.deadlines import PERIOD_MS, Deadlines
from quadriga.plant.pace import TeamPace
from quadriga.plant.protocol import TOLD_TO_STOP, End
from quadriga.plant.server import PlantServer
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
    config, names = server.config, server.plant.names
    # A world that fell behind slows down: in ticks made up for at once nobody could answer.
    rate, deadlines = pace or Rate(TICK, slack=_SLACK), Deadlines(names)
    timeouts = {name: CommandTimeout(config.world, config.gait.stand_ms) for name in names}
    end: End | None = None
    while end is None and not stopped():
        server.publish()
        deadlines.note_lateness(rate.wait())  # meanwhile the agents answer
        for packet in server.bus.drain():
            server.take(*packet, oldest=0)
        if server.plant.tick % SAMPLE_MS == 0:
            _check_others(server)
        end = server.step(_choose_commands(server, timeouts, deadlines))
        if server.plant.tick % PERIOD_MS == 0 or end is not None:
            server.publish_status(deadlines.status(server.plant.tick, rate.overruns))
    code, detail = end or TOLD_TO_STOP
    late = deadlines.describe_late()
    return End(code, f"{detail}; late ticks: {late}; overruns of the world: {rate.overruns}")


def _check_others(server: PlantServer) -> None:
    """See whether the agents, the other plants and the link to the router are still there."""
    server.check_link()
    present = server.bus.members_at(HERE)
    if not server.plant.is_robot:  # a bridge sees to its robot itself
        server.end_without(set(server.plant.names) - present, "gone")
    server.time.look(present, server.plant.tick)


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
