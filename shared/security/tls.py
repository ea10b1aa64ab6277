"""The files of mutual TLS, and what Zenoh is told of them.

The folder of certificates has one folder for each identity, which is all that its machine needs:
the authority's certificate, its own, and its key.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from quadriga.shared.errors import ConfigError
from quadriga.shared.security.roll import identity_of, split_common_name

AUTHORITY: Final = "authority.pem"
CERTIFICATE: Final = "certificate.pem"
KEY: Final = "key.pem"
_OTHERS: Final = 0o077  # permissions of a file that others than its owner have
_TLS: Final = "transport/link/tls"


@dataclass(frozen=True, slots=True)
class TlsFiles:
    """What one process shows and trusts.

    Attributes:
        authority: certificate of who signs the team's.
        certificate: the process's own.
        key: its private key.
    """

    authority: Path
    certificate: Path
    key: Path

    @classmethod
    def within(cls, folder: Path) -> TlsFiles:
        """Those in the folder of one identity."""
        return cls(folder / AUTHORITY, folder / CERTIFICATE, folder / KEY)


def identity_folder(certificates: Path, identity: str) -> Path:
    """The folder of one identity."""
    return certificates / identity


def tls_files(certificates: str, process: str) -> TlsFiles:
    """The files of a process.

    Args:
        certificates: the folder of the configuration.
        process: its name on the bus.

    Raises:
        ConfigError: one is missing or empty, others may read the key, or the certificate is
            somebody else's.
    """
    identity = identity_of(process)
    files = TlsFiles.within(identity_folder(Path(certificates).absolute(), identity))
    copy = f"copy the folder {identity} to this machine"
    for path in (files.authority, files.certificate, files.key):
        if not path.is_file() or not path.stat().st_size:
            got = "an empty file" if path.is_file() else "no such file"
            cause = f"`quadriga certs make` makes it; {copy}"
            raise ConfigError(str(path), got, f"the certificates of {identity}", cause)
    if files.key.stat().st_mode & _OTHERS:
        mode = f"mode {files.key.stat().st_mode & 0o777:o}"
        raise ConfigError(str(files.key), mode, "600", "others may read this private key")
    # Imported here: 0.1 s, which processes without certificates need not wait for.
    from quadriga.shared.security.certificate import read_certificate

    name = read_certificate(files.certificate).name
    if split_common_name(name)[0] != identity:  # the router would silently deny what it says
        got, cause = f"the certificate {name!r}", f"copied under another name? {copy}"
        raise ConfigError(str(files.certificate), got, f"one of {identity}", cause)
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
