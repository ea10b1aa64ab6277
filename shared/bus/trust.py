"""Before a process connects with a certificate: do it and the router trust each other?"""

from __future__ import annotations

from typing import Final

from quadriga.shared.bus.zenoh_settings import NO_LINK
from quadriga.shared.config.endpoints import is_tls
from quadriga.shared.config.sections import BusConfig
from quadriga.shared.errors import BusError
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
