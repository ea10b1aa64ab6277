"""An agent's end of the plant link: how it finds its plant, and what goes to and fro."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Final

from quadriga.shared import topics
from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.config.endpoints import is_loopback
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError
from quadriga.shared.link.connections import (
    CLOSED,
    NOTHING,
    BusConnection,
    Connection,
    connect,
    local_address,
)
from quadriga.shared.link.packets import (
    COMMAND,
    COMMAND_SIZE,
    END,
    HELLO,
    STATE,
    WELCOME,
    PacketBuffer,
    RowPacket,
    text_packet,
)
from quadriga.shared.members import plant_name
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.clock import monotonic

_PATIENCE: Final = 5.0  # s, for the plant's answer; it may be building its world
_AGAIN: Final = 0.5  # s, after which hello is said again over the bus


class AgentEnd:
    """A robot's connection to its plant.

    Attributes:
        received: what `receive` has received.
        command: the packet of the next command.
        plant: name of the plant.
        ended: why the walk is over, as the plant says; "": it has not said so.
        closed: whether the plant is gone.
        malformed: number of packets that were none.
    """

    def __init__(self, config: Config, robot: str, bus: Bus) -> None:
        self._config, self._robot, self._bus = config, robot, bus
        place = robot_names(config.team.robots).index(robot)
        self.plant = plant_name(robot if config.team.plant_per_robot else "")
        self.received, self.command = PacketBuffer(), RowPacket(COMMAND, place, COMMAND_SIZE)
        self.ended, self.closed, self.malformed = "", False, 0
        self._hello = text_packet(HELLO, place, robot)
        self._way: Connection | None = None
        self._over_bus: BusConnection | None = None
        if config.plant.link != "local":
            team = config.team.name
            put = bus.publisher(
                topics.COMMAND.link_key(team, robot), waits=config.world.mode == "lockstep"
            )
            self._over_bus = BusConnection(put, lambda: self.plant not in bus.members_at(HERE))
            bus.hear(topics.STATE.link_key(team, robot), self._over_bus.arrived.put)

    def open(self, stopped: Callable[[], bool]) -> bool:
        """Connect to the plant, which is on the bus; False if `stopped()` came first.

        Raises:
            BusError: it refuses, or does not answer.
        """
        way = self._way = self._connect()
        said, deadline = -_AGAIN, monotonic() + _PATIENCE
        while not stopped():
            if monotonic() > said + _AGAIN:  # over the bus it may hear this process later
                said = monotonic()
                way.send(self._hello)
            size = way.receive(self.received.view, wait=True)
            if size == CLOSED or monotonic() > deadline:
                raise self._error("no answer", "it was stopped, or is frozen")
            if size == NOTHING:
                continue
            fault = self.received.parse(size)
            if not fault and self.received.kind == WELCOME:
                return True
            why = fault or self.received.text(size)
            raise self._error(f"refused: {why}", "another version, user or robot, or started twice")
        return False

    def _connect(self) -> Connection:
        """The way to the plant: its socket, if it is on this computer, or the bus."""
        kind, endpoint = self._config.plant.link, self._config.bus.endpoint
        address = local_address(self._config, self.plant)
        if kind != "bus" and address is not None:
            with suppress(OSError):
                return connect(address)
        # Who is on the loopback is on this computer. Without a folder of this user neither listens.
        is_near = kind == "local" or (is_loopback(endpoint) and address is not None)
        if self._over_bus is None or (kind != "bus" and is_near):
            cause = "is it another user's, or in a container? plant.link = bus goes by the bus"
            raise self._error(f"no socket {address} that takes this user", cause)
        return self._over_bus

    def _error(self, got: str, cause: str) -> BusError:
        name = f"link of {self._robot} to {self.plant} of team {self._bus.team!r}"
        return BusError(name, got, "a plant that takes this agent's commands", cause)

    def receive(self, *, wait: bool) -> bool:
        """Whether a state has come, into `received`; sees the end of the walk, and of the plant."""
        assert self._way is not None
        size = self._way.receive(self.received.view, wait=wait)
        if size == NOTHING:
            return False
        if size == CLOSED:
            self.closed = True
        elif not self.received.parse(size):
            if self.received.kind == END:
                self.ended = self.received.text(size) or "over"
            return self.received.kind == STATE
        else:
            self.malformed += 1
        return False

    def send(self, packet: memoryview) -> None:
        """Send a command."""
        assert self._way is not None
        self._way.send(packet)

    def close(self) -> None:
        """Leave."""
        if self._way is not None:
            self._way.close()
