"""Lock-step: a tick is taken when every robot's command of that tick is there."""

from __future__ import annotations

from collections.abc import Callable

from quadriga.plant.protocol import TOLD_TO_STOP, End
from quadriga.plant.server import PlantServer
from quadriga.shared.bus.session import HERE, POLL
from quadriga.shared.messages import Command
from quadriga.shared.runtime.clock import monotonic


def run_lockstep(server: PlantServer, stopped: Callable[[], bool]) -> End:
    """Step until the walk is over; why it is."""
    while not stopped():
        server.publish()
        commands = _await_commands(server, stopped)
        if stopped():
            break  # commands may be missing that nobody has lost
        end = server.time.end or server.step(commands)
        if end is not None:
            return end
    return TOLD_TO_STOP


def _await_commands(server: PlantServer, stopped: Callable[[], bool]) -> dict[str, Command]:
    """This tick's commands, by robot in the team's order; ends the walk if one does not come."""
    tick, box, bus = server.plant.tick, server.commands, server.bus
    patience = server.config.world.command_timeout
    waiting, deadline = set(server.plant.names), monotonic() + patience
    while waiting and not stopped() and server.time.end is None:
        left = deadline - monotonic()
        packet = bus.get(min(max(left, 0.0), POLL))
        if packet is not None:
            waiting.discard(server.take(*packet, oldest=tick))
        elif left <= 0.0:  # this process may have stood still, not the robots
            server.end_without(waiting, f"silent for {patience:g} s")
        else:
            server.check_link()
            server.end_without(waiting - bus.members_at(HERE), "gone")
    return {name: box.latest[name] for name in server.plant.names if box.tick_of(name) == tick}
