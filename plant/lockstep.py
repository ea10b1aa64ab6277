"""Lock-step: a tick is taken when every robot's command of that tick is there."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from quadriga.plant.server import PlantServer
from quadriga.shared.bus.zenoh_bus import HERE, POLL
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.wire.messages import Command

ANSWERS: Final = "answers again"  # how the event of a robot's return ends; a replay reads it
_ALONE: Final = 0.001  # s, pace of a world that nobody answers, so that robots can come back


def run_lockstep(server: PlantServer, stopped: Callable[[], bool]) -> str:
    """Step until the walk is over; the reason why it is."""
    while not stopped():
        server.publish()
        if reason := server.step(_commands(server, stopped)):
            return reason
    return "signal"


def _commands(server: PlantServer, stopped: Callable[[], bool]) -> dict[str, Command]:
    """This tick's commands, by robot in the team's order; silent robots are left out."""
    tick, box, bus = server.plant.tick, server.commands, server.bus
    waiting = set(server.plant.names) - server.silent
    alone = not waiting
    deadline = monotonic() + (_ALONE if alone else server.config.world.command_timeout)
    while (waiting or alone) and not stopped():
        left = deadline - monotonic()
        if left <= 0.0:
            _give_up(server, waiting, f"silent for {server.config.world.command_timeout:g} s")
            break
        packet = bus.get(min(left, POLL))
        if packet is None:
            gone = waiting - bus.present(HERE)
            _give_up(server, gone, "gone")
            waiting -= gone
        elif robot := box.take(*packet, tick=tick, oldest=tick):
            waiting.discard(robot)
            if robot in server.silent:
                server.silent.discard(robot)
                server.announce("fault", robot, ANSWERS)
    return {name: box.latest[name] for name in server.plant.names if box.tick_of(name) == tick}


def _give_up(server: PlantServer, robots: set[str], why: str) -> None:
    for robot in sorted(robots):
        server.silent.add(robot)
        server.announce("fault", robot, f"{why}: its joints are damped, the world goes on")
