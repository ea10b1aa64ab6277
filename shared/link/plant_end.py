"""A plant's end of the plant link: who may be connected, and what goes to and fro."""

from __future__ import annotations

import os
import socket
from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from threading import Lock, Thread
from typing import Final

from quadriga.shared import topics
from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError
from quadriga.shared.link.connections import (
    CLOSED,
    BusConnection,
    Connection,
    LocalConnection,
    listen,
    local_address,
)
from quadriga.shared.link.packets import (
    END,
    HEADER,
    HELLO,
    REFUSED,
    STATE,
    STATE_SIZE,
    TEXT_MOST,
    WELCOME,
    PacketBuffer,
    RowPacket,
    fault_of,
    text_packet,
)
from quadriga.shared.messages import State
from quadriga.shared.robots.conventions import robot_names

_HELLO_TIMEOUT: Final = 2.0  # s, within which who connects says who it is


class PlantEnd:
    """The connections of a plant, one to the agent of each of its robots.

    Attributes:
        received: what `receive` has received.
        connected: by robot.
    """

    def __init__(self, config: Config, names: Sequence[str], bus: Bus) -> None:
        self._config, self._bus, self._lockstep = config, bus, config.world.mode == "lockstep"
        team = robot_names(config.team.robots)
        self._places = {name: team.index(name) for name in names}
        self._states = {
            name: RowPacket(STATE, place, STATE_SIZE) for name, place in self._places.items()
        }
        self.connected: dict[str, Connection] = {}
        self.received = PacketBuffer()
        self._lock = Lock()  # connections come in by threads of their own
        self._over_bus: dict[str, BusConnection] = {}
        self._listener: socket.socket | None = None
        self._address: Path | None = None

    def open(self) -> None:
        """Listen from now on.

        Raises:
            BusError: the socket cannot be made.
        """
        kind, team = self._config.plant.link, self._config.team.name
        if kind != "local":
            for name in self._places:
                key, waits = topics.STATE.link_key(team, name), self._lockstep
                put = self._bus.publisher(key, waits=waits)
                way = BusConnection(put, partial(self._is_gone, name))
                self._over_bus[name] = way
                self._bus.hear(topics.COMMAND.link_key(team, name), partial(self._take, name, way))
        address = local_address(self._config, self._bus.name)
        if kind == "bus" or (address is None and kind != "local"):
            return
        try:
            if address is None:
                raise OSError("no folder that is this user's alone")
            self._listener = listen(address)
        except OSError as error:
            cause = "XDG_RUNTIME_DIR is where it is; plant.link = bus does without"
            raise BusError("plant.link", str(error), "a socket of this user", cause) from None
        self._address = address
        Thread(target=self._accept, args=(self._listener,), daemon=True).start()

    @property
    def heard_by_others(self) -> list[str]:
        """Robots whose packets go over the bus, where others may be who send some."""
        return [name for name, way in self._over_bus.items() if self.connected.get(name) is way]

    def send(self, name: str, state: State) -> None:
        """Send a robot's agent its state."""
        way, packet = self.connected.get(name), self._states[name]
        if way is not None:
            packet.row[:] = state.row
            way.send(packet.stamp(state.tick, state.stamp_ns))

    def receive(self, name: str, *, wait: bool) -> int:
        """As `Connection.receive` of a robot's next packet, into `received`."""
        way = self.connected.get(name)
        return CLOSED if way is None else way.receive(self.received.view, wait=wait)

    def close(self, why: str = "") -> None:
        """Say that the walk is over, and why, if it is; then leave."""
        if self._listener is not None and self._address is not None:
            self._address.unlink(missing_ok=True)
            with suppress(OSError):
                self._listener.shutdown(socket.SHUT_RDWR)  # wakes who accepts
            self._listener = None
        with self._lock:
            while self.connected:
                name, way = self.connected.popitem()
                if why:
                    way.send(text_packet(END, self._places[name], why))
                way.close()

    def _is_gone(self, name: str) -> bool:
        return name not in self._bus.members_at(HERE)

    def _accept(self, listener: socket.socket) -> None:
        """Take in who connects, one by one, until `close`."""
        room = memoryview(bytearray(HEADER.size + TEXT_MOST))
        while True:
            try:
                link, _ = listener.accept()
            except OSError:
                listener.close()
                return
            link.settimeout(_HELLO_TIMEOUT)
            try:
                hello = bytes(room[: link.recv_into(room)])
            except OSError:
                link.close()
                continue
            way = LocalConnection(link)
            foreign = way.user != os.getuid() and f"a process of user {way.user}"
            if not self._greet(hello, way, foreign or ""):
                way.close()

    def _take(self, name: str, way: BusConnection, packet: bytes) -> None:
        """A packet has come over the bus, in the receiving thread."""
        if self.connected.get(name) is way and packet[2:3] != bytes([HELLO]):
            way.arrived.put(packet)
        elif fault_of(packet) or packet[2] == HELLO:
            self._greet(packet, way, "")

    def _greet(self, hello: bytes, way: Connection, foreign: str) -> bool:
        """Connect who says hello, or tell it why not; whether it is connected."""
        name = hello[HEADER.size :].decode("utf-8", "replace")
        fault = foreign or fault_of(hello)
        with self._lock:
            known = self.connected.get(name)
            if not fault and name not in self._places:
                fault = f"robot {name!r}, expected one of {', '.join(self._places)}"
            elif not fault and known not in (None, way):
                fault = f"a second agent of robot {name!r}"
            if fault:
                way.send(text_packet(REFUSED, text=fault))
                return False
            self.connected[name] = way  # first: who is welcome is there
            way.send(text_packet(WELCOME, self._places[name]))
        return True
