"""Where an endpoint may be: off the loopback only with certificates, or if that is waived."""

from __future__ import annotations

import re
from ipaddress import ip_address
from typing import Final

from quadriga.shared.config.sections import BusConfig
from quadriga.shared.errors import ConfigError

_ANY_PORT: Final = re.compile(r":0+(?=[?#]|$)")
_TLS: Final = "tls/HOST:PORT"
# Protocols of Zenoh that reach other machines; what it does not know it refuses itself.
_NETWORK: Final = ("tcp", "udp", "quic", "quic_datagram", "ws", "vsock", "serial")


def is_tls(endpoint: str) -> bool:
    """Whether an endpoint is one of mutual TLS."""
    return endpoint.startswith("tls/")


def host_and_port(endpoint: str) -> tuple[str, int]:
    """Host and port of `tls/HOST:PORT`; an IPv6 address without its brackets.

    Raises:
        ConfigError: it is not of this form.
    """
    host, port = _split(endpoint.partition("/")[2])
    if not host or not port.isdecimal() or int(port) > 65535:
        raise ConfigError("bus.endpoint", repr(endpoint), _TLS)
    return host, int(port)


def _split(address: str) -> tuple[str, str]:
    host, _, port = address.rpartition(":")
    return host.removeprefix("[").removesuffix("]"), port


def is_loopback(endpoint: str) -> bool:
    """Whether only processes of this machine reach an endpoint without certificates."""
    protocol, _, address = endpoint.partition("/")
    if protocol not in _NETWORK or not address:
        return True
    host, _ = _split(re.split("[?#]", address)[0])
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False


def check_port(name: str, endpoint: str) -> None:
    """Refuse an endpoint where any free port would be taken, which the others would not find.

    Raises:
        ConfigError: it has port 0.
    """
    if _ANY_PORT.search(endpoint):
        cause = "without bus.endpoint a walk finds a port that is free"
        raise ConfigError(name, repr(endpoint), "a port of 1 … 65535", cause)


def check_exposure(bus: BusConfig, name: str, endpoint: str) -> None:
    """Refuse an endpoint at which others could command the robots.

    The name is that of the key or the option that has the endpoint.

    Raises:
        ConfigError: it is off the loopback without certificates, or has certificates in a way
            that does not protect it.
    """
    if is_tls(endpoint):
        host_and_port(endpoint)
        if "#" in endpoint or "?" in endpoint:
            cause = "the certificates are those of bus.certificates"
            raise ConfigError(name, repr(endpoint), f"{_TLS} without settings", cause)
        if bus.mode != "client":
            cause = "only a router checks who may send what"
            raise ConfigError("bus.mode", f"{bus.mode!r} with {endpoint}", "'client'", cause)
    elif not (is_loopback(endpoint) or bus.plaintext):
        raise ConfigError(
            name,
            repr(endpoint),
            f"{_TLS} with bus.mode = 'client', or an address of the loopback",
            "whoever reaches another endpoint commands the robots: see docs/security.md; "
            "bus.plaintext = true accepts that",
        )
