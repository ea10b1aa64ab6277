"""Whether the certificates that a computer holds are good, and for how long: pure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Final

from quadriga.shared.bus.diagnostics import BAD, GOOD, NOTE, Diagnosis
from quadriga.shared.security.certificates import EXPIRED, NOT_YET_VALID, Certificate

CERTIFICATE: Final = "certificate"
CERTIFICATE_EARLY: Final = "certificate-not-yet-valid"
CERTIFICATE_EXPIRED: Final = "certificate-expired"
CERTIFICATE_EXPIRING: Final = "certificate-expiring"
CERTIFICATE_UNTRUSTED: Final = "certificate-untrusted"
CERTIFICATE_UNREADABLE: Final = "certificate-unreadable"
KEY_OPEN: Final = "key-open"

_SOON: Final = 7.0  # days: time to renew
_OTHERS: Final = 0o077  # permissions of others than the owner


@dataclass(frozen=True, slots=True)
class HeldCertificate:
    """What a computer holds of one identity.

    Attributes:
        identity: whose.
        certificate: None: it cannot be read.
        signed: whether the authority beside it has signed it.
        key_mode: permissions of its private key; None: there is no key.
        problem: why it cannot be read.
    """

    identity: str
    certificate: Certificate | None
    signed: bool = False
    key_mode: int | None = None
    problem: str = ""


def check_certificates(held: Sequence[HeldCertificate], now: datetime) -> tuple[Diagnosis, ...]:
    """All that is wrong with them, or one line that they are good.

    Args:
        held: by this computer.
        now: by its clock.
    """
    found = tuple(item for each in held for item in _check(each, now))
    days = [each.certificate.days_left(now) for each in held if each.certificate]
    if found or not days:
        return found
    names = ", ".join(each.identity for each in held)
    text = f"certificates of {names}: valid for {min(days):.0f} days at least"
    return (Diagnosis(CERTIFICATE, GOOD, text),)


def _check(held: HeldCertificate, now: datetime) -> Iterator[Diagnosis]:
    name, certificate = held.identity, held.certificate
    again = f"`quadriga certs renew {name}`, and copy its folder to its machine"
    if held.key_mode is None:
        text = f"there is no private key of {name}"
        yield Diagnosis(CERTIFICATE_UNREADABLE, BAD, text, f"copy the whole folder {name}")
    elif held.key_mode & _OTHERS:
        text = f"others can read the private key of {name} (mode {held.key_mode:o})"
        yield Diagnosis(KEY_OPEN, BAD, text, f"chmod 600 {name}/key.pem; renew it if it was read")
    if certificate is None:
        yield Diagnosis(CERTIFICATE_UNREADABLE, BAD, f"that of {name}: {held.problem}", again)
        return
    days = certificate.days_left(now)
    if certificate.name != name:
        text = f"the folder {name} has the certificate of {certificate.name}"
        yield Diagnosis(CERTIFICATE_UNTRUSTED, BAD, text, f"copy the folder {name} again")
    if not held.signed:
        text = f"that of {name} is not signed by the authority whose certificate is beside it"
        cause = "files of two teams, or of before `quadriga certs make` began anew: copy the folder"
        yield Diagnosis(CERTIFICATE_UNTRUSTED, BAD, text, cause)
    state = certificate.state(now)
    if state == NOT_YET_VALID:
        text = f"that of {name} is not valid before {certificate.begins:%F %T} UTC"
        yield Diagnosis(CERTIFICATE_EARLY, BAD, text, "is the clock of this computer right?")
    elif state == EXPIRED:
        text = f"that of {name} expired {-days:.1f} days ago"
        yield Diagnosis(CERTIFICATE_EXPIRED, BAD, text, again)
    elif days < _SOON:
        text = f"that of {name} expires in {days:.1f} days"
        yield Diagnosis(CERTIFICATE_EXPIRING, NOTE, text, again)
