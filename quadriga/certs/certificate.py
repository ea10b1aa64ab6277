"""What is of interest of a certificate that somebody holds."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.x509.oid import NameOID

from quadriga.shared.errors import ConfigError, name_file_errors


@dataclass(frozen=True, slots=True)
class Certificate:
    """A certificate.

    Attributes:
        name: its common name.
        hosts: at which its owner listens.
        expires: when it is not valid any more.
    """

    name: str
    hosts: tuple[str, ...]
    expires: datetime

    def days_left(self, now: datetime) -> float:
        """Until it expires; negative afterwards."""
        return (self.expires - now) / timedelta(days=1)


def read_certificate(path: Path) -> Certificate:
    """A certificate from its file.

    Raises:
        ConfigError: it cannot be read, or is none.
    """
    found = _load(path)
    try:
        names = found.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
        hosts = _hosts_of(found)
    except ValueError as error:
        raise _damaged(path, error) from None
    name = str(names[0].value) if names else ""
    return Certificate(name, hosts, found.not_valid_after_utc)


def is_signed(path: Path, authority: Path) -> bool:
    """Whether the certificate in one file is signed by the owner of that in another.

    Raises:
        ConfigError: one cannot be read, or is none.
    """
    try:
        _load(path).verify_directly_issued_by(_load(authority))
    except (ValueError, TypeError, InvalidSignature):  # another name, another key
        return False
    return True


def _load(path: Path) -> x509.Certificate:
    with name_file_errors(ConfigError, path, "a certificate", "`quadriga certs make` makes it"):
        text = path.read_bytes()
    try:
        return x509.load_pem_x509_certificate(text)
    except ValueError as error:
        raise _damaged(path, error) from None


def _damaged(path: Path, error: ValueError) -> ConfigError:
    return ConfigError(str(path), str(error)[:200], "a certificate", "damaged?")


def _hosts_of(found: x509.Certificate) -> tuple[str, ...]:
    try:
        names = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return ()
    return tuple(str(name.value) for name in names)
