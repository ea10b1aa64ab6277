"""Whether a process and its router trust each other, and how the router is reached."""

from __future__ import annotations

from typing import Final

from quadriga.shared.bus.reach import try_endpoint
from quadriga.shared.bus.zenoh_settings import NO_LINK
from quadriga.shared.config.endpoints import is_tls
from quadriga.shared.config.sections import BusConfig
from quadriga.shared.errors import BusError, QuadrigaError
from quadriga.shared.security.handshake import CAUSES, TRUSTED, UNREACHABLE, shake_hands
from quadriga.shared.security.tls import tls_files

_GOT: Final = {UNREACHABLE: f"{NO_LINK}: "}


def check_trust(bus: BusConfig, name: str) -> None:
    """Whether process `name` and the router trust each other, if they ask for it.

    Raises:
        BusError: nobody answers, or one does not trust the other; it says who and why.
        ConfigError: a certificate is missing or cannot be used.
    """
    if not is_tls(bus.endpoint):
        return
    found = shake_hands(bus.endpoint, tls_files(bus.certificates, name))
    if found.outcome != TRUSTED:
        raise BusError(
            f"bus.endpoint {bus.endpoint!r} of {name}",
            f"{_GOT.get(found.outcome, f'{found.outcome}: ')}{found.detail}",
            "a router that is trusted and trusts this process",
            CAUSES[found.outcome],
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
