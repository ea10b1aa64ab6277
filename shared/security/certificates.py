"""Certificates: what is of interest of one that somebody holds, and what Zenoh is told of it.

The folder of certificates has one folder for each identity, which is all that its machine needs:
the authority's certificate, its own, and its key.

Imported only where there are certificates: `cryptography` takes 0.1 s.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, Final, NamedTuple

from cryptography import x509
from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.x509.oid import NameOID

from quadriga.shared.errors import ConfigError, name_file_errors
from quadriga.shared.security.access import identity_of

AUTHORITY: Final = "authority.pem"
CERTIFICATE: Final = "certificate.pem"
KEY: Final = "key.pem"
_OTHERS: Final = 0o077  # permissions of a file that others than its owner have
_TLS: Final = "transport/link/tls"

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


class Certificate(NamedTuple):
    """A certificate: its common name, at which hosts its owner listens, and when it is valid."""

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
        with warnings.catch_warnings(action="ignore"):  # what is unusual can be read all the same
            names = found.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
            extensions = found.extensions
        alternative = extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        hosts = tuple(str(name.value) for name in alternative)
    except x509.ExtensionNotFound:
        hosts = ()
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
    with warnings.catch_warnings(action="ignore"):
        return x509.load_pem_x509_certificate(text)


def describe_pem_error(text: bytes, error: Exception) -> str:
    """What is wrong with a PEM file; the library's words are about itself where there is no PEM."""
    if b"-----BEGIN " in text:
        return str(error)
    return "text that is not PEM" if text.strip() else "an empty file"


def _load(path: Path) -> x509.Certificate:
    with name_file_errors(ConfigError, path, "a certificate", "`quadriga certs make` makes it"):
        text = path.read_bytes()
    try:
        return load_certificate(text)
    except UNREADABLE as error:
        raise _damaged(path, describe_pem_error(text, error)) from None


def _damaged(path: Path, got: str) -> ConfigError:
    return ConfigError(str(path), got[:200], "a certificate", "damaged? `quadriga certs renew`")


class TlsFiles(NamedTuple):
    """What one process shows and trusts: whose signature, its own certificate and private key."""

    authority: Path
    certificate: Path
    key: Path

    @classmethod
    def within(cls, folder: Path) -> TlsFiles:
        """Those in the folder of one identity."""
        return cls(folder / AUTHORITY, folder / CERTIFICATE, folder / KEY)


def tls_files(certificates: str, process: str) -> TlsFiles:
    """The files of a process, by its name on the bus, in the folder of the configuration.

    Raises:
        ConfigError: one is missing or empty, others may read the key, or the certificate is
            somebody else's.
    """
    identity = identity_of(process)
    files = TlsFiles.within(Path(certificates).absolute() / identity)
    copy = f"`quadriga certs make` makes it; copy the folder {identity} to this machine"
    with name_file_errors(ConfigError, files.key.parent, "a folder that this user may enter"):
        for path in files:
            if not path.is_file() or not path.stat().st_size:
                got = "an empty file" if path.is_file() else "no such file"
                raise ConfigError(str(path), got, f"that of {identity}", copy)
        mode = files.key.stat().st_mode & 0o777
    if mode & _OTHERS:
        cause = "others may read this private key"
        raise ConfigError(str(files.key), f"mode {mode:o}", "600", cause)
    name = read_certificate(files.certificate).name
    if name != identity:  # the router would silently deny what it says
        got = f"the certificate of {name!r}"
        raise ConfigError(str(files.certificate), got, f"that of {identity}", copy)
    return files


def tls_settings(files: TlsFiles, *, listens: bool) -> Mapping[str, Any]:
    """Zenoh's settings of who listens with these files, or of who connects.

    Each shows its certificate and trusts only those of the authority. Who connects also expects
    the address that it asked for in the listener's certificate.
    """
    side = "listen" if listens else "connect"
    return {
        "transport/link/protocols": ["tls"],
        f"{_TLS}/root_ca_certificate": str(files.authority),
        f"{_TLS}/{side}_certificate": str(files.certificate),
        f"{_TLS}/{side}_private_key": str(files.key),
        f"{_TLS}/enable_mtls": True,
        f"{_TLS}/verify_name_on_connect": True,
        f"{_TLS}/close_link_on_expiration": True,
    }
