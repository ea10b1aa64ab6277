"""Whether an endpoint can be reached from here and trusts this process, and why not."""

from __future__ import annotations

import re
import socket
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from quadriga.shared.bus.settings import NO_LINK
from quadriga.shared.config.endpoints import is_tls
from quadriga.shared.config.sections import BusConfig
from quadriga.shared.errors import BusError, QuadrigaError

OPEN: Final = "open"  # something listens there
REFUSED: Final = "refused"
SILENT: Final = "silent"
UNRESOLVED: Final = "unresolved"
UNREACHABLE: Final = "unreachable"
UNTRIED: Final = "untried"

_TIMEOUT: Final = 1.0  # s
_LAST_PORT: Final = 65535
_STREAMS: Final = ("tcp", "tls")
# Zenoh's form: protocol/HOST:PORT, with settings of its own behind ? or #.
_ENDPOINT: Final = re.compile(r"(\w+)/\[?([^\[\]?#]+?)\]?:(\d{1,5})([?#].*)?")


@dataclass(frozen=True, slots=True)
class Reach:
    """What came of the attempt: one of the codes of this module, and the same in words."""

    code: str
    text: str


def split_endpoint(endpoint: str) -> tuple[str, str, int] | None:
    """Protocol, host and port of an endpoint; None if it has not this form."""
    found = _ENDPOINT.fullmatch(endpoint)
    if found is None or int(found[3]) > _LAST_PORT:
        return None
    return found[1], found[2], int(found[3])


def is_loopback(endpoint: str) -> bool:
    """Whether an endpoint can be reached from its own computer alone."""
    parts = split_endpoint(endpoint)
    return parts is not None and (parts[1] in ("localhost", "::1") or parts[1].startswith("127."))


def try_endpoint(endpoint: str, timeout: float = _TIMEOUT) -> Reach:
    """Connect to an endpoint and close again, without a word.

    That something listens there does not mean that it is Zenoh, nor, with TLS, that it trusts this
    computer: only a handshake tells that.
    """
    parts = split_endpoint(endpoint)
    if parts is None or parts[0] not in _STREAMS:
        return Reach(UNTRIED, f"{endpoint} was not tried: only tcp and tls can be")
    _, host, port = parts
    try:
        socket.create_connection((host, port), timeout).close()
    except socket.gaierror:
        return Reach(UNRESOLVED, f"the name {host} does not resolve here")
    except (ConnectionRefusedError, ConnectionResetError):
        return Reach(REFUSED, f"nobody listens at {endpoint}")
    except TimeoutError:
        why = "it is off, in another network, or behind a firewall"
        return Reach(SILENT, f"{host} does not answer within {timeout:g} s: {why}")
    except OSError as error:
        return Reach(UNREACHABLE, f"{endpoint} cannot be reached: {error}")
    return Reach(OPEN, f"something listens at {endpoint}")


def tls_of(bus: BusConfig, endpoint: str, name: str, *, listens: bool) -> Mapping[str, Any]:
    """Zenoh's settings of process `name`, which shows certificates at a `tls/` endpoint; else none.

    Raises:
        ConfigError: a certificate is missing or cannot be used.
    """
    if not is_tls(endpoint):
        return {}
    from quadriga.shared.security.certificates import tls_files, tls_settings

    return tls_settings(tls_files(bus.certificates, name), listens=listens)


def check_trust(bus: BusConfig, name: str) -> None:
    """Whether process `name` and the router trust each other, if they ask for it.

    Raises:
        BusError: nobody answers, or one does not trust the other; it says who and why.
        ConfigError: a certificate is missing or cannot be used.
    """
    if not is_tls(bus.endpoint):
        return
    from quadriga.shared.security import handshake
    from quadriga.shared.security.certificates import tls_files

    found = handshake.shake_hands(bus.endpoint, tls_files(bus.certificates, name))
    if found.outcome != handshake.TRUSTED:
        got = NO_LINK if found.outcome == handshake.UNREACHABLE else found.outcome
        raise BusError(
            f"bus.endpoint {bus.endpoint!r} of {name}",
            f"{got}: {found.detail}",
            "a router that is trusted and trusts this process",
            handshake.CAUSES[found.outcome],
        )


def describe_way(bus: BusConfig, name: str) -> str:
    """How `bus.endpoint` is reached from here by process `name`, in words.

    It takes seconds if nobody answers. Zenoh itself never says why there is no link.
    """
    if not is_tls(bus.endpoint):
        return try_endpoint(bus.endpoint).text
    try:
        check_trust(bus, name)
    except QuadrigaError as error:
        return f"{error.name}: {error.got} ({error.cause})"
    return f"the router at {bus.endpoint} and {name} trust each other"
