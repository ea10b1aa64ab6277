"""A free place on this machine for a team of its own."""

from __future__ import annotations

import secrets
import socket
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from hashlib import sha256
from typing import Any, Final

from quadriga.shared.bus.settings import OPEN, try_endpoint
from quadriga.shared.config.sections import BusConfig, Config
from quadriga.shared.errors import ConfigError

_PORT: Final = 7447  # Zenoh's own
_IPV6: Final = "tcp/[::1]"


def with_free_endpoint(config: Config, given: Mapping[str, Any]) -> Config:
    """The configuration with an endpoint that nobody else uses, unless one was asked for.

    Several walks on one machine are the rule; only who names an endpoint wants that one.

    Args:
        config: the team's configuration.
        given: what of it was given explicitly, by section and key.

    Raises:
        ConfigError: somebody listens already at the one that was asked for: a team that would hear
            another one's messages.
    """
    if config.bus.mode != "peer":
        return config
    if "endpoint" in given.get("bus", {}):
        endpoint = config.bus.endpoint
        if try_endpoint(endpoint).code == OPEN:
            raise _taken_error(f"{endpoint}, where something listens")
        return config
    endpoint, listen = free_endpoint(), config.bus.listen
    if endpoint.startswith(_IPV6) and listen == BusConfig().listen:
        listen = f"{_IPV6}:0"
    return replace(config, bus=replace(config.bus, endpoint=endpoint, listen=listen))


@contextmanager
def endpoint_claimed(config: Config) -> Iterator[None]:
    """Within the block no other walk of this computer has this team's place: of two one is refused.

    In client mode a place is the router's endpoint and the team's name.

    Raises:
        ConfigError: another walk has it.
    """
    bus, team = config.bus, config.team.name
    place = bus.endpoint if bus.mode == "peer" else f"{bus.endpoint}, team {team!r}"
    with socket.socket(socket.AF_UNIX) as claim:
        try:  # a name without a file: it is gone with the process, however that ends
            claim.bind(f"\0quadriga-{sha256(place.encode()).hexdigest()}")
        except OSError:
            raise _taken_error(f"{place}, where another walk begins or goes on") from None
        yield


def _taken_error(got: str) -> ConfigError:
    cause = "another team walks there? without bus.endpoint each walk finds a place"
    return ConfigError("bus.endpoint", got, "an endpoint of its own", cause)


def free_endpoint() -> str:
    """An endpoint on this machine that nobody listens on at the moment.

    It has a loopback address of its own (127.0.0.0/8, RFC 1122), where the system permits one:
    a port at 127.0.0.1 may be given to another process, even of the same team, before the sim
    server listens there, which would end one walk in some thousands. Without IPv4 it is ::1.

    Raises:
        OSError: there is no loopback at all.
    """
    address = (f"127.{'.'.join(map(str, secrets.token_bytes(2)))}.2", _PORT)
    for host, port in (address, ("127.0.0.1", 0)):
        with suppress(OSError):
            return _free(host, port)
    return _free("::1", 0)


def _free(host: str, port: int) -> str:
    """The endpoint at an address whose port may be 0: any free one.

    Raises:
        OSError: it cannot be listened on.
    """
    is_ipv6 = ":" in host
    with socket.socket(socket.AF_INET6 if is_ipv6 else socket.AF_INET) as probe:
        probe.bind((host, port))
        port = probe.getsockname()[1]
        return f"{_IPV6}:{port}" if is_ipv6 else f"tcp/{host}:{port}"
