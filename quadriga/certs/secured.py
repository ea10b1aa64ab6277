"""A team behind a router with certificates of its own, for one walk on this computer."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Final

from quadriga.certs.folder import CertificateFolder
from quadriga.shared.config.endpoints import host_and_port
from quadriga.shared.config.sections import Config
from quadriga.shared.security.roll import team_roll

_DAYS: Final = 1.0  # that these certificates are valid


def secure(config: Config, folder: Path, now: datetime) -> Config:
    """The same team through a router with certificates, which are made.

    Args:
        config: of a team at an address of this computer.
        folder: gets the certificates.
        now: by the clock of this computer.
    """
    endpoint = f"tls/{config.bus.endpoint.partition('/')[2]}"
    bus = replace(config.bus, mode="client", endpoint=endpoint, certificates=str(folder))
    secured = replace(config, bus=bus)
    certificates_of(secured).make(config.team.name, [host_and_port(endpoint)[0]], now, _DAYS)
    return secured


def certificates_of(config: Config) -> CertificateFolder:
    """The folder of a team's certificates, for all that its configuration gives one."""
    names = [who.name for who in team_roll(config)]
    return CertificateFolder(Path(config.bus.certificates), names)
