"""Whether an endpoint can be reached from here, and why not."""

from __future__ import annotations

import re
import socket
from dataclasses import dataclass
from typing import Final

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


def is_loopback(endpoint: str) -> bool:
    """Whether an endpoint can be reached from its own computer alone."""
    parts = split_endpoint(endpoint)
    return parts is not None and (parts[1] in ("localhost", "::1") or parts[1].startswith("127."))
