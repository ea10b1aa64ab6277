"""The folder of a team's certificates: made, renewed, shown."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Final

from quadriga.certs.authority import Authority, Pair, Subject
from quadriga.shared.config.endpoints import host_and_port
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError, did_you_mean, name_file_errors
from quadriga.shared.members import ROUTER
from quadriga.shared.runtime.atomic import atomic_write, write_bytes
from quadriga.shared.security.access import team_identities
from quadriga.shared.security.certificates import (
    AUTHORITY,
    EXPIRED,
    Certificate,
    TlsFiles,
    is_signed,
    read_certificate,
)

_AUTHORITY_KEY: Final = "authority.key"
_PRIVATE: Final = 0o600
_OWN: Final = 0o700
# Beside the hosts that are given: a router's own machine always reaches it.
_HERE: Final = ("localhost", "127.0.0.1", "::1")
_ONE_WALK: Final = 1.0  # days that certificates for one walk are valid


@dataclass(frozen=True, slots=True)
class Standing:
    """How one identity stands.

    Attributes:
        identity: who.
        certificate: the one in the folder.
        signed: whether the authority beside it has signed it.
    """

    identity: str
    certificate: Certificate
    signed: bool

    def state(self, now: datetime) -> str:
        """In words whether its process can use it."""
        if self.certificate.name != self.identity:
            return f"somebody else's ({self.certificate.name})"
        return self.certificate.state(now) if self.signed else "another authority's"


class CertificateFolder:
    """`<folder>/<identity>/…`, and the authority's own files.

    Args:
        path: the folder, `bus.certificates`.
        identities: who may have a certificate.
    """

    def __init__(self, path: Path, identities: Sequence[str]) -> None:
        self.path, self._identities = path, tuple(identities)

    @classmethod
    def of_team(cls, config: Config) -> CertificateFolder:
        """The folder of a team, for all that its configuration gives a certificate."""
        names = [who.name for who in team_identities(config)]
        return cls(Path(config.bus.certificates), names)

    def make(self, team: str, hosts: Sequence[str], now: datetime, days: float) -> list[str]:
        """Give the team an authority, and everybody a certificate who has none that is valid.

        Returns:
            Who was given one.

        Raises:
            ConfigError: something in the folder cannot be read.
            OSError: it cannot be written.
        """
        self.path.mkdir(mode=_OWN, parents=True, exist_ok=True)
        if (self.path / _AUTHORITY_KEY).exists():
            authority = self._authority()
        else:
            authority = Authority.create(team, now)
            _write_private(self.path / _AUTHORITY_KEY, authority.pair.key)
            write_bytes(self.path / AUTHORITY, authority.pair.certificate)
        valid = {s.identity for s in self.standings() if s.certificate.state(now) != EXPIRED}
        without = [name for name in self._identities if name not in valid]
        for name in without:
            self._issue(authority, name, hosts, now, days)
        return without

    def renew(
        self, names: Iterable[str], hosts: Sequence[str], now: datetime, days: float
    ) -> list[str]:
        """Give these identities, or all for none, a new certificate; who they were.

        The old ones stay valid until they expire. A router keeps its addresses unless others are
        given.

        Raises:
            ConfigError: there is no such identity, or no authority.
            OSError: the folder cannot be written.
        """
        chosen = self._check(names) or list(self._identities)
        authority = self._authority()
        for name in chosen:
            self._issue(authority, name, hosts, now, days)
        return chosen

    def standings(self) -> list[Standing]:
        """How each identity that has a certificate stands.

        Raises:
            ConfigError: something in the folder cannot be read.
        """
        found = []
        for name in self._identities:
            files = TlsFiles.within(self.path / name)
            if files.certificate.exists():
                signed = is_signed(files.certificate, files.authority)
                found.append(Standing(name, read_certificate(files.certificate), signed))
        return found

    def _authority(self) -> Authority:
        cause = "`quadriga certs` is run where the authority's key is kept"
        with name_file_errors(ConfigError, self.path, "the authority of a team", cause):
            certificate = (self.path / AUTHORITY).read_bytes()
            key = (self.path / _AUTHORITY_KEY).read_bytes()
        return Authority(Pair(certificate, key))

    def _issue(
        self, authority: Authority, name: str, hosts: Sequence[str], now: datetime, days: float
    ) -> None:
        """Write a certificate of an identity; a router's has the addresses at which it listens."""
        files, listens = TlsFiles.within(self.path / name), tuple[str, ...]()
        if name == ROUTER:
            if not hosts and files.certificate.exists():
                hosts = read_certificate(files.certificate).hosts
            listens = tuple(dict.fromkeys((*hosts, *_HERE)))
        pair = authority.issue(Subject(name, listens), now, days)
        files.key.parent.mkdir(mode=_OWN, parents=True, exist_ok=True)
        _write_private(files.key, pair.key)
        write_bytes(files.authority, authority.pair.certificate)
        write_bytes(files.certificate, pair.certificate)

    def _check(self, names: Iterable[str]) -> list[str]:
        given = list(names)
        for name in given:
            if name not in self._identities:
                known = ", ".join(self._identities)
                hint = did_you_mean(name, self._identities)
                raise ConfigError("certificate of", repr(name), f"one of {known}", hint)
        return given


def secure(config: Config, folder: Path, now: datetime) -> Config:
    """The same team behind a router with certificates, which are made for one walk.

    Args:
        config: of a team at an address of this computer.
        folder: gets the certificates.
        now: by the clock of this computer.
    """
    endpoint = f"tls/{config.bus.endpoint.partition('/')[2]}"
    bus = replace(config.bus, mode="client", endpoint=endpoint, certificates=str(folder))
    secured = replace(config, bus=bus)
    hosts = [host_and_port(endpoint)[0]]
    CertificateFolder.of_team(secured).make(config.team.name, hosts, now, _ONE_WALK)
    return secured


def _write_private(path: Path, content: bytes) -> None:
    """Write a file that nobody but its owner ever could read."""
    with atomic_write(path) as partial:
        descriptor = os.open(partial, os.O_WRONLY | os.O_CREAT | os.O_EXCL, _PRIVATE)
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
