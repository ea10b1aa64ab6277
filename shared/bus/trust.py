"""Whether a process and its router trust each other, and how the router is reached."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from quadriga.shared.bus.reach import try_endpoint
from quadriga.shared.bus.zenoh_settings import NO_LINK
from quadriga.shared.config.endpoints import is_tls
from quadriga.shared.config.sections import BusConfig
from quadriga.shared.errors import BusError, QuadrigaError


def tls_of(bus: BusConfig, endpoint: str, name: str, *, listens: bool) -> Mapping[str, Any]:
    """Settings of who shows certificates at an endpoint; none of another endpoint.

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
    from quadriga.shared.security.certificates import tls_files
    from quadriga.shared.security.handshake import CAUSES, TRUSTED, UNREACHABLE, shake_hands

    found = shake_hands(bus.endpoint, tls_files(bus.certificates, name))
    if found.outcome != TRUSTED:
        raise BusError(
            f"bus.endpoint {bus.endpoint!r} of {name}",
            f"{NO_LINK if found.outcome == UNREACHABLE else found.outcome}: {found.detail}",
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
