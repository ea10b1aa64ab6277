"""The authority of a team: signs the certificates of its identities."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from ipaddress import ip_address
from typing import Final

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    load_pem_private_key,
)
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from quadriga.shared.errors import ConfigError
from quadriga.shared.security.certificates import UNREADABLE, describe_pem_error, load_certificate

_YEARS: Final = timedelta(days=3650)  # of the authority itself
# RFC 1123, and `_` as container networks have it; digits alone are an address with a mistake.
_HOST_NAME: Final = re.compile(
    r"(?=.{1,253}$)(?![0-9.]+$)((?!-)[A-Za-z0-9_-]{1,63}(?<!-)\.)*(?!-)[A-Za-z0-9_-]{1,63}(?<!-)"
)
_SKEW: Final = timedelta(hours=1)  # that a clock may be behind when a certificate is new


@dataclass(frozen=True, slots=True)
class Pair:
    """A certificate and its private key, as PEM."""

    certificate: bytes
    key: bytes


@dataclass(frozen=True, slots=True)
class Subject:
    """Who a certificate is for.

    Attributes:
        name: its common name.
        hosts: names and addresses at which its owner listens; () of one who only connects.
    """

    name: str
    hosts: tuple[str, ...] = ()


class Authority:
    """Signs certificates. Its private key is worth as much as all of them together."""

    def __init__(self, pair: Pair) -> None:
        """Use a pair that `create` made.

        Raises:
            ConfigError: it is none.
        """
        self.pair = pair
        try:
            self._certificate = load_certificate(text := pair.certificate)
            key = load_pem_private_key(text := pair.key, password=None)
        except UNREADABLE as error:
            raise _unreadable("authority of the team", describe_pem_error(text, error)) from None
        if not isinstance(key, ec.EllipticCurvePrivateKey):
            raise _unreadable("key of the team's authority", type(key).__name__)
        self._key = key

    @classmethod
    def create(cls, team: str, now: datetime) -> Authority:
        """A new one, which trusts itself alone."""
        key = ec.generate_private_key(ec.SECP256R1())
        name = _name(f"authority of {team}"[:64])
        builder = (
            _builder(name, name, key, now, _YEARS)
            .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
            .add_extension(_usage(signs_certificates=True), critical=True)
        )
        return cls(_pair(builder.sign(key, hashes.SHA256()), key))

    def issue(self, subject: Subject, now: datetime, days: float) -> Pair:
        """A certificate for one identity, and the key that goes with it.

        Who listens cannot connect with it, and who connects cannot listen.
        """
        key = ec.generate_private_key(ec.SECP256R1())
        side = ExtendedKeyUsageOID.SERVER_AUTH if subject.hosts else ExtendedKeyUsageOID.CLIENT_AUTH
        issuer = self._key.public_key()
        builder = (
            _builder(_name(subject.name), self._certificate.subject, key, now, timedelta(days=days))
            .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
            .add_extension(_usage(signs_certificates=False), critical=True)
            .add_extension(x509.ExtendedKeyUsage([side]), critical=False)
            .add_extension(
                x509.AuthorityKeyIdentifier.from_issuer_public_key(issuer), critical=False
            )
        )
        if subject.hosts:
            names = x509.SubjectAlternativeName([*map(_host, subject.hosts)])
            builder = builder.add_extension(names, critical=False)
        return _pair(builder.sign(self._key, hashes.SHA256()), key)


def _builder(
    subject: x509.Name,
    issuer: x509.Name,
    key: ec.EllipticCurvePrivateKey,
    now: datetime,
    duration: timedelta,
) -> x509.CertificateBuilder:
    public = key.public_key()
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(public)
        .serial_number(x509.random_serial_number())
        .not_valid_before(now.astimezone(UTC) - _SKEW)
        .not_valid_after(now.astimezone(UTC) + duration)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(public), critical=False)
    )


def _usage(*, signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs_certificates,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=signs_certificates,
        crl_sign=signs_certificates,
        encipher_only=False,
        decipher_only=False,
    )


def _name(text: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, text)])


def _host(text: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ip_address(text))
    except ValueError:
        pass
    if not _HOST_NAME.fullmatch(text):
        raise ConfigError("--router", repr(text[:80]), "a host name or an address")
    return x509.DNSName(text)


def _pair(certificate: x509.Certificate, key: ec.EllipticCurvePrivateKey) -> Pair:
    return Pair(
        certificate.public_bytes(Encoding.PEM),
        key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()),
    )


def _unreadable(name: str, error: object) -> ConfigError:
    return ConfigError(name, str(error)[:200], "PEM that `quadriga certs` wrote", "damaged?")
