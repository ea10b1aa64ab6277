"""The two transports of the plant link: unix sockets of one computer, and keys of the bus.

Over a socket a connection that is closed is a process that has ended: the system closes what a
killed one leaves behind. Over the bus its token has vanished.
"""

from __future__ import annotations

import socket
import struct
from collections.abc import Callable
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import Final, Protocol

from quadriga.shared.bus.ring_buffer import Mailbox
from quadriga.shared.bus.session import POLL
from quadriga.shared.config.sections import Config
from quadriga.shared.runtime.places import make_runtime_dir

CLOSED: Final = 0  # in place of a number of bytes: the other end is gone
NOTHING: Final = -1  # nothing has come

_KIND: Final = socket.SOCK_SEQPACKET  # packets whole and in order, and the end of a connection
_POLL: Final = struct.pack("ll", 0, round(1e6 * POLL))  # timeval
_NOW: Final = socket.MSG_DONTWAIT
_CREDENTIALS: Final = struct.Struct("3i")  # process, user and group of a peer
_HELD: Final = 256  # packets that wait for a process at most; of a frozen one the oldest go
_WAITING: Final = 64  # connections that wait to be accepted


class Connection(Protocol):
    """A way between a plant and the agent of one of its robots; packets come whole, in order."""

    def send(self, packet: bytes | memoryview) -> None:
        """Send a packet, unless the other end is gone, or has long not read."""
        ...

    def receive(self, into: memoryview, *, wait: bool) -> int:
        """Bytes of the oldest packet that has come, or comes soon if `wait`; `CLOSED`, `NOTHING`.

        What does not fit is cut off.
        """
        ...

    def close(self) -> None:
        """Let the other end know that this one is gone."""
        ...


class LocalConnection:
    """A connected unix socket."""

    def __init__(self, link: socket.socket) -> None:
        link.settimeout(None)
        link.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, _POLL)
        self._link, self._send, self._receive = link, link.send, link.recv_into

    def send(self, packet: bytes | memoryview) -> None:
        try:  # half the time of `suppress`
            self._send(packet, _NOW)
        except OSError:
            return

    def receive(self, into: memoryview, *, wait: bool) -> int:
        try:
            size: int = self._receive(into, 0, 0 if wait else _NOW)
        except BlockingIOError:
            return NOTHING
        except OSError:
            return CLOSED
        return size

    def close(self) -> None:
        self._link.close()

    @property
    def user(self) -> int:
        """The user whose process is at the other end."""
        about = self._link.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
        _, user, _ = _CREDENTIALS.unpack(about)
        return int(user)


class BusConnection:
    """A pair of keys of the bus.

    Args:
        put: sends on the one.
        is_gone: whether the process at the other end is.

    Attributes:
        arrived: what has come on the other one.
    """

    def __init__(self, put: Callable[[bytes], None], is_gone: Callable[[], bool]) -> None:
        self._put, self._is_gone = put, is_gone
        self.arrived: Mailbox[bytes] = Mailbox(_HELD)

    def send(self, packet: bytes | memoryview) -> None:
        self._put(bytes(packet))

    def receive(self, into: memoryview, *, wait: bool) -> int:
        packet = self.arrived.take(POLL if wait else 0.0)
        if packet is None:
            return CLOSED if self._is_gone() else NOTHING
        size = min(len(packet), len(into))
        into[:size] = packet[:size]
        return size or 1  # an empty one is no end: one byte is no packet either, and is refused

    def close(self) -> None:
        return


def local_address(config: Config, plant: str) -> Path | None:
    """The socket on which this plant listens; None if this user has no folder of their own."""
    folder, of = make_runtime_dir(), f"{config.bus.endpoint} {config.team.name} {plant}"
    name = sha256(of.encode()).hexdigest()[:20]
    return None if folder is None else folder / f"{name}.link"


def listen(address: Path) -> socket.socket:
    """A socket that listens; one that a killed plant has left is replaced.

    Raises:
        OSError: it cannot be made there, or somebody listens.
    """
    listener = socket.socket(socket.AF_UNIX, _KIND)
    try:
        with suppress(ConnectionRefusedError, FileNotFoundError):
            connect(address).close()
            raise FileExistsError(f"somebody listens at {address}")
        address.unlink(missing_ok=True)
        listener.bind(str(address))
        address.chmod(0o600)
        listener.listen(_WAITING)
    except BaseException:
        listener.close()
        raise
    return listener


def connect(address: Path) -> LocalConnection:
    """A connection to who listens there.

    Raises:
        OSError: nobody does, or this user may not.
    """
    link = socket.socket(socket.AF_UNIX, _KIND)
    try:
        link.connect(str(address))
    except BaseException:
        link.close()
        raise
    return LocalConnection(link)
