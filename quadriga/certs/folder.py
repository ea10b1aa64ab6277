"""The folder of a team's certificates: made, renewed, revoked, shown."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from fcntl import LOCK_EX, flock
from pathlib import Path
from typing import Final

from quadriga.certs.authority import Authority, Pair, Subject
from quadriga.shared.errors import ConfigError, did_you_mean, name_file_errors
from quadriga.shared.members import ROUTER
from quadriga.shared.runtime.atomic import atomic_write, write_bytes, write_text
from quadriga.shared.security.certificate import Certificate, is_signed, read_certificate
from quadriga.shared.security.roll import (
    MOST_VALID,
    REVOKED,
    common_name,
    format_numbers,
    read_numbers,
    split_common_name,
)
from quadriga.shared.security.tls import AUTHORITY, TlsFiles, identity_folder

_AUTHORITY_KEY: Final = "authority.key"
_ISSUED: Final = "issued.json"  # by identity how many certificates it was given
_LOCK: Final = ".lock"  # held by who changes the folder
_PRIVATE: Final = 0o600
_OWN: Final = 0o700
# Beside the hosts that are given: a router's own machine always reaches it.
_HERE: Final = ("localhost", "127.0.0.1", "::1")


@dataclass(frozen=True, slots=True)
class Standing:
    """How one identity stands.

    Attributes:
        identity: who.
        certificate: the one in the folder.
        revoked: whether the router refuses it, once it has heard of it.
        signed: whether the authority beside it has signed it.
    """

    identity: str
    certificate: Certificate
    revoked: bool
    signed: bool

    def state(self, now: datetime) -> str:
        """In words whether its process can use it."""
        owner = split_common_name(self.certificate.name)[0]
        if owner != self.identity:
            return f"somebody else's ({owner})"
        if not self.signed:
            return "another authority's"
        return "revoked" if self.revoked else self.certificate.state(now)


class CertificateFolder:
    """`<folder>/<identity>/…`, and the authority's own files.

    Args:
        path: the folder, `bus.certificates`.
        identities: who may have a certificate.
    """

    def __init__(self, path: Path, identities: Sequence[str]) -> None:
        self.path, self._identities = path, tuple(identities)

    def make(self, team: str, hosts: Sequence[str], now: datetime, days: float) -> list[str]:
        """Give everybody a certificate who has none, and the team an authority; who was given one.

        Raises:
            ConfigError: something in the folder cannot be read.
            OSError: it cannot be written.
        """
        self.path.mkdir(mode=_OWN, parents=True, exist_ok=True)
        with self._alone():
            if (self.path / _AUTHORITY_KEY).exists():
                authority = self._authority()
            else:
                authority = Authority.create(team, now)
                _write_private(self.path / _AUTHORITY_KEY, authority.pair.key)
                write_bytes(self.path / AUTHORITY, authority.pair.certificate)
            without = [n for n in self._identities if not self._files(n).certificate.exists()]
            for name in without:
                self._issue(authority, name, hosts if name == ROUTER else (), now, days)
            self._write_numbers(self.revoked_file, self._numbers(self.revoked_file))
        return without

    def renew(
        self, names: Iterable[str], hosts: Sequence[str], now: datetime, days: float
    ) -> list[str]:
        """Give these identities, or all for none, a new certificate; what stands in them.

        The old ones stay valid until they expire or are revoked. A router keeps its addresses
        unless others are given.

        Raises:
            ConfigError: there is no such identity, or it has too many that are valid.
            OSError: the folder cannot be written.
        """
        chosen, made = self._check(names) or self._identities, []
        authority = self._authority()
        with self._alone():
            for name in chosen:
                listens = hosts or self._hosts(name) if name == ROUTER else ()
                made.append(self._issue(authority, name, listens, now, days))
        return made

    def revoke(self, names: Iterable[str]) -> list[str]:
        """Have the router refuse all certificates that these identities were given so far.

        Returns:
            The common names that are not valid any more.

        Raises:
            ConfigError: there is no such identity, or it is the router's, which nobody asks.
            OSError: the folder cannot be written.
        """
        gone, chosen = [], self._check(names)
        if ROUTER in chosen:
            cause = "`quadriga certs make` in an empty folder replaces everything"
            raise ConfigError("revoke", repr(ROUTER), "who connects to the router", cause)
        with self._alone():
            issued, revoked = self._numbers(self._issued_file), self._numbers(self.revoked_file)
            for name in chosen:
                before, last = revoked.get(name, 0), issued.get(name, 0)
                gone += [common_name(name, k) for k in range(before + 1, last + 1)]
                revoked[name] = last
            self._write_numbers(self.revoked_file, revoked)
        return gone

    def standings(self) -> list[Standing]:
        """How each identity that has a certificate stands.

        Raises:
            ConfigError: something in the folder cannot be read.
        """
        revoked = self._numbers(self.revoked_file)
        found = []
        for name in self._identities:
            path = self._files(name).certificate
            if path.exists():
                held = read_certificate(path)
                number = split_common_name(held.name)[1]
                signed = is_signed(path, self._files(name).authority)
                found.append(Standing(name, held, number <= revoked.get(name, 0), signed))
        return found

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """Within the block no other process changes the folder: no number is given twice."""
        with name_file_errors(ConfigError, self.path, "the certificates of a team"):
            lock = (self.path / _LOCK).open("a", encoding="utf-8")
        with lock:
            flock(lock, LOCK_EX)
            yield

    @property
    def _issued_file(self) -> Path:
        return self.path / _ISSUED

    @property
    def revoked_file(self) -> Path:
        """What the router must know of who is revoked."""
        return identity_folder(self.path, ROUTER) / REVOKED

    def _files(self, identity: str) -> TlsFiles:
        return TlsFiles.within(identity_folder(self.path, identity))

    def _authority(self) -> Authority:
        cause = "`quadriga certs` is run where the authority's key is kept"
        with name_file_errors(ConfigError, self.path, "the authority of a team", cause):
            certificate = (self.path / AUTHORITY).read_bytes()
            key = (self.path / _AUTHORITY_KEY).read_bytes()
        return Authority(Pair(certificate, key))

    def _hosts(self, name: str) -> Sequence[str]:
        return read_certificate(self._files(name).certificate).hosts

    def _issue(
        self, authority: Authority, name: str, hosts: Sequence[str], now: datetime, days: float
    ) -> str:
        """Write the next certificate of an identity; its common name."""
        issued = self._numbers(self._issued_file)
        number = issued.get(name, 0) + 1
        if number > self._numbers(self.revoked_file).get(name, 0) + MOST_VALID:
            raise ConfigError(
                f"certificates of {name}",
                f"{MOST_VALID} that are valid",
                f"at most {MOST_VALID}",
                f"`quadriga certs revoke {name}` first",
            )
        listens = tuple(dict.fromkeys((*hosts, *_HERE))) if name == ROUTER else ()
        subject = Subject(common_name(name, number), listens)
        pair = authority.issue(subject, now, days)
        # Counted before it is written: a number is never given twice.
        self._write_numbers(self._issued_file, {**issued, name: number})
        files = self._files(name)
        files.key.parent.mkdir(mode=_OWN, parents=True, exist_ok=True)
        _write_private(files.key, pair.key)
        write_bytes(files.authority, authority.pair.certificate)
        write_bytes(files.certificate, pair.certificate)
        return subject.name

    def _check(self, names: Iterable[str]) -> list[str]:
        given = list(names)
        for name in given:
            if name not in self._identities:
                known = ", ".join(self._identities)
                hint = did_you_mean(name, self._identities)
                raise ConfigError("certificate of", repr(name), f"one of {known}", hint)
        return given

    def _numbers(self, path: Path) -> dict[str, int]:
        if not path.exists():
            return {}
        with name_file_errors(ConfigError, path, "numbers of certificates"):
            return read_numbers(path.read_text(encoding="utf-8"), str(path))

    def _write_numbers(self, path: Path, numbers: dict[str, int]) -> None:
        path.parent.mkdir(mode=_OWN, parents=True, exist_ok=True)
        write_text(path, format_numbers(numbers))


def _write_private(path: Path, content: bytes) -> None:
    """Write a file that nobody but its owner ever could read."""
    with atomic_write(path) as partial:
        descriptor = os.open(partial, os.O_WRONLY | os.O_CREAT | os.O_EXCL, _PRIVATE)
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
