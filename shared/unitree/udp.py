"""SHELL of a UDP port that never waits: what has come is taken, what cannot be sent is dropped."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from typing import Final, NamedTuple

from quadriga.shared.errors import BridgeError, ConfigError, system_reason

_LONGEST: Final = 2048  # bytes: longer than any packet, so that one too long is seen as such
_AT_ONCE: Final = 64  # packets of a call: a flood must not hold up who drains it


class Address(NamedTuple):
    """Where packets come in or go to; host "" is every address of this machine."""

    host: str
    port: int


def parse_address(text: str, name: str, default: Address) -> Address:
    """HOST:PORT.

    Args:
        text: of the configuration; empty for the default.
        name: of the key, for the error.
        default: where nothing is said.

    Raises:
        ConfigError: there is no port, or none of 1 … 65535, or no such host.
    """
    if not text:
        return default
    host, colon, port = text.rpartition(":")
    if not colon or not port.isdecimal() or not 0 < int(port) < 65536:
        raise ConfigError(name, repr(text), "HOST:PORT, with a port of 1 … 65535")
    try:
        return Address(host and socket.gethostbyname(host), int(port))
    except (OSError, UnicodeError) as error:
        expected, cause = "a host that has an IPv4 address", "write the address in numbers"
        raise ConfigError(name, f"{text!r}: {error}", expected, cause) from None


class UdpPort:
    """A bound socket, and whom it usually sends to.

    Raises:
        BridgeError: another process has the port, or the address is not of this machine.
    """

    def __init__(self, local: Address, peer: Address | None = None) -> None:
        self._peer = peer
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        try:
            self._socket.bind(local)
        except OSError as error:
            self._socket.close()
            where = f"UDP port {local.port} of {local.host or 'this machine'}"
            cause = "does a bridge run already? `ip address` lists this machine's addresses"
            expected = "a free port of this machine"
            raise BridgeError(where, system_reason(error), expected, cause) from None

    def drain(self) -> Iterator[tuple[bytes, Address]]:
        """Packets that have come, oldest first, with who sent them."""
        for _ in range(_AT_ONCE):
            try:
                packet, sender = self._socket.recvfrom(_LONGEST)
            except BlockingIOError:
                return
            except ConnectionError:  # nobody listened where an earlier packet went
                continue
            yield packet, Address(*sender[:2])

    def send(self, packet: bytes, to: Address | None = None) -> bool:
        """Send; whether the system took it."""
        address = to or self._peer
        if address is None:
            return False
        try:
            self._socket.sendto(packet, address)
        except OSError:
            return False
        return True

    def close(self) -> None:
        """Give the port back."""
        self._socket.close()
