"""Lock-step: a tick is taken when every robot's command of that tick is there."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from quadriga.plant.end import TOLD_TO_STOP, End
from quadriga.plant.server import PlantServer
from quadriga.plant.team_time import plant_gone
from quadriga.shared import codes
from quadriga.shared.bus.session import HERE, POLL
from quadriga.shared.messages import Command
from quadriga.shared.runtime.clock import monotonic

_ALONE: Final = 0.001  # s, pace of a world that nobody answers, so that robots can come back


def run_lockstep(server: PlantServer, stopped: Callable[[], bool]) -> End:
    """Step until the walk is over; why it is."""
    while not stopped():
        server.publish()
        commands = _commands(server, stopped)
        end = _await_plants(server, stopped)
        if end is None and stopped():
            break  # commands may be missing that nobody has lost
        end = end or server.step(commands)
        if end is not None:
            return end
    return TOLD_TO_STOP


def _commands(server: PlantServer, stopped: Callable[[], bool]) -> dict[str, Command]:
    """This tick's commands, by robot in the team's order; silent robots are left out."""
    tick, box, bus = server.plant.tick, server.commands, server.bus
    waiting = set(server.plant.names) - server.silent
    alone = not waiting
    patience = _ALONE if alone else server.config.world.command_timeout
    deadline = monotonic() + patience
    while (waiting or alone) and not stopped() and server.time.end is None:
        left = deadline - monotonic()
        packet = bus.get(min(max(left, 0.0), POLL))
        if packet is None and left <= 0.0:  # this process may have stood still, not the robots
            silence = f"silent for {server.config.world.command_timeout:g} s"
            _give_up(server, waiting, codes.SILENT, silence)
            break
        if packet is None:
            server.look_at_link()
            if server.time.end is not None:
                break
            server.time.look(bus.members_at(HERE))
            gone = waiting - bus.members_at(HERE)
            _give_up(server, gone, codes.GONE, "gone")
            waiting -= gone
        elif robot := server.take(*packet, oldest=tick):
            waiting.discard(robot)
            if robot in server.silent:
                server.silent.discard(robot)
                server.announce(codes.BACK, robot, "answers again")
    return {name: box.latest[name] for name in server.plant.names if box.tick_of(name) == tick}


def _await_plants(server: PlantServer, stopped: Callable[[], bool]) -> End | None:
    """Wait until the other plants let this tick be taken; why the walk ends, if it does."""
    tick, time, bus = server.plant.tick, server.time, server.bus
    # Longer than a plant waits for its own robot, for which this one then waits too.
    patience = 2.0 * server.config.world.command_timeout
    deadline = monotonic() + patience
    while time.end is None and (waiting := time.awaited(tick)) and not stopped():
        packet = bus.get(POLL)
        if packet is not None:
            server.take(*packet, oldest=tick)
        elif monotonic() > deadline:
            time.end = plant_gone(sorted(waiting), f"silent for {patience:g} s")
        else:
            server.look_at_link()
            time.look(bus.members_at(HERE))
    return time.end


def _give_up(server: PlantServer, robots: set[str], code: str, why: str) -> None:
    for robot in sorted(robots):
        said = server.explain_silence(robot, why)
        server.silent.add(robot)
        server.announce(code, robot, f"{said}: the world goes on without its commands")
