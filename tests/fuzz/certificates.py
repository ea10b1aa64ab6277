"""What the folder of a team's certificates holds: of somebody who may have written anything."""

from __future__ import annotations

import base64
import warnings
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import numpy as np
from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding
from cryptography.x509.oid import NameOID

from quadriga.certs.authority import Authority, Pair, Subject
from quadriga.certs.folder import CertificateFolder
from quadriga.shared.members import ROUTER
from quadriga.shared.security.certificates import (
    AUTHORITY,
    CERTIFICATE,
    is_signed,
    read_certificate,
)
from tests.fuzz.damage import damage
from tests.fuzz.target import Reader

_NOW: Final = datetime(2026, 1, 1, tzinfo=UTC)
_NAMES: Final = ("r1." + "9" * 5000, "", "r1.1", "r1.\u0663", "\x1b[2J", "x" * 3000, ".", "r1.-1")


class Certificates:
    """Certificates, damaged as text or in what the text packs, or made by somebody else."""

    def __init__(self, folder: Path) -> None:
        authority = Authority.create("team", _NOW)
        pair = authority.issue(Subject("router", ("localhost", "127.0.0.1")), _NOW, 30.0)
        self._folder = CertificateFolder(folder / "certificates", (ROUTER, "r1"))
        self._path = folder / "certificates" / ROUTER / CERTIFICATE
        self._path.parent.mkdir(parents=True)
        self._authority = self._path.with_name(AUTHORITY)
        self._authority.write_bytes(authority.pair.certificate)
        self._good = [pair.certificate, authority.pair.certificate]
        key = ec.generate_private_key(ec.SECP256R1())
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of names that are longer than they may be
            self._forged = [_forge(name, key) for name in _NAMES]

    def make(self, random: np.random.Generator) -> bytes:
        good, kind = self._good[int(random.integers(2))], random.random()
        if kind < 0.3:
            return damage(good, random)
        if kind < 0.4:
            return self._forged[int(random.integers(len(_NAMES)))]
        packed = x509.load_pem_x509_certificate(good).public_bytes(Encoding.DER)
        at = int(random.integers(len(packed)))
        hurt = packed[:at] + bytes([int(random.integers(256))]) + packed[at + 1 :]
        return _pem(hurt if kind < 0.8 else damage(packed, random))

    def read(self, content: bytes) -> None:
        self._path.write_bytes(content)
        is_signed(self._path, self._authority)
        read_certificate(self._path).days_left(_NOW)
        self._folder.standings()


def authorities(_folder: Path) -> Reader:
    """Certificate and key of a team's authority."""
    pair = Authority.create("team", _NOW).pair

    def change(_: bytes, random: np.random.Generator) -> bytes:
        if random.random() < 0.5:
            return damage(pair.certificate, random) + b"\0\0" + pair.key
        return pair.certificate + b"\0\0" + damage(pair.key, random)

    def read(content: bytes) -> None:
        certificate, _, key = content.partition(b"\0\0")
        Authority(Pair(certificate, key))

    return Reader((b"",), read, change)


def _forge(name: str, key: ec.EllipticCurvePrivateKey) -> bytes:
    """A certificate of any name, which its owner has signed."""
    issuer = x509.Name([x509.NameAttribute(NameOID.ORGANIZATION_NAME, "somebody")])
    title = [x509.NameAttribute(NameOID.COMMON_NAME, name, _validate=False)] if name else []
    builder = (
        x509.CertificateBuilder(issuer, x509.Name(title), key.public_key(), 7)
        .not_valid_before(_NOW)
        .not_valid_after(datetime(9999, 12, 31, tzinfo=UTC))
    )
    return builder.sign(key, hashes.SHA256()).public_bytes(Encoding.PEM)


def _pem(packed: bytes) -> bytes:
    body = base64.encodebytes(packed)
    return b"-----BEGIN CERTIFICATE-----\n" + body + b"-----END CERTIFICATE-----\n"
