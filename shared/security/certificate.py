"""What is of interest of a certificate that somebody holds."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import Final

from cryptography import x509
from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.x509.oid import NameOID

from quadriga.shared.errors import ConfigError, name_file_errors

VALID: Final = "valid"
NOT_YET_VALID: Final = "not yet valid"
EXPIRED: Final = "expired"

# What is raised on bytes that are no certificate, or one that nobody can use.
UNREADABLE: Final = (
    ValueError,
    UnsupportedAlgorithm,
    x509.InvalidVersion,
    x509.DuplicateExtension,
    x509.UnsupportedGeneralNameType,
    TypeError,  # of a name whose text is bits
)


@dataclass(frozen=True, slots=True)
class Certificate:
    """A certificate.

    Attributes:
        name: its common name.
        hosts: at which its owner listens.
        begins: from when on it is valid.
        expires: when it is not valid any more.
    """

    name: str
    hosts: tuple[str, ...]
    begins: datetime
    expires: datetime

    def days_left(self, now: datetime) -> float:
        """Until it expires; negative afterwards."""
        return (self.expires - now) / timedelta(days=1)

    def state(self, now: datetime) -> str:
        """`VALID`, `NOT_YET_VALID` or `EXPIRED`."""
        if now < self.begins:
            return NOT_YET_VALID
        return VALID if now < self.expires else EXPIRED


def read_certificate(path: Path) -> Certificate:
    """A certificate from its file.

    Raises:
        ConfigError: it cannot be read, or is none.
    """
    found = _load(path)
    try:
        with _without_warnings():
            names = found.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
            hosts = _hosts_of(found)
    except UNREADABLE as error:
        raise _damaged(path, str(error)) from None
    name = str(names[0].value) if names else ""
    return Certificate(name, hosts, found.not_valid_before_utc, found.not_valid_after_utc)


def is_signed(path: Path, authority: Path) -> bool:
    """Whether the certificate in one file is signed by the owner of that in another.

    Raises:
        ConfigError: one cannot be read, or is none.
    """
    try:
        _load(path).verify_directly_issued_by(_load(authority))
    except (*UNREADABLE, InvalidSignature):  # another name, another key
        return False
    return True


def load_certificate(text: bytes) -> x509.Certificate:
    """A certificate of a PEM text.

    Raises:
        one of UNREADABLE: it is none.
    """
    with _without_warnings():
        return x509.load_pem_x509_certificate(text)


def _load(path: Path) -> x509.Certificate:
    with name_file_errors(ConfigError, path, "a certificate", "`quadriga certs make` makes it"):
        text = path.read_bytes()
    try:
        return load_certificate(text)
    except UNREADABLE as error:
        raise _damaged(path, describe_pem_error(text, error)) from None


@contextmanager
def _without_warnings() -> Iterator[None]:
    """Say nothing of what is unusual in a certificate that can be read all the same."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def describe_pem_error(text: bytes, error: Exception) -> str:
    """What is wrong with a PEM file; the library's words are about itself where there is no PEM."""
    if b"-----BEGIN " in text:
        return str(error)
    return "text that is not PEM" if text.strip() else "an empty file"


def _damaged(path: Path, got: str) -> ConfigError:
    return ConfigError(str(path), got[:200], "a certificate", "damaged? `quadriga certs renew`")


def _hosts_of(found: x509.Certificate) -> tuple[str, ...]:
    try:
        names = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return ()
    return tuple(str(name.value) for name in names)
