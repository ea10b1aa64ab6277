"""SHELL: whether the certificates that a computer holds are good, and the router trusts them."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import Final

from quadriga.shared.bus.diagnostics import BAD, GOOD, NOTE, Diagnosis
from quadriga.shared.bus.settings import NO_LINK, check_trust
from quadriga.shared.config.endpoints import is_tls
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError, QuadrigaError
from quadriga.shared.security.access import team_identities
from quadriga.shared.security.certificates import (
    NOT_YET_VALID,
    VALID,
    is_signed,
    read_certificate,
    tls_files,
)

_SOON: Final = 7.0  # days: time to renew


def check_certificates(config: Config, now: datetime) -> Iterator[Diagnosis]:
    """All that is wrong with those of a team that are here, or one line that they are good."""
    if not is_tls(config.bus.endpoint):
        return
    folder, good = Path(config.bus.certificates), dict[str, float]()
    for name in (who.name for who in team_identities(config)):
        if not (folder / name).is_dir():
            continue
        again = f"`quadriga certs renew {name}`, and copy its folder to its machine"
        try:
            files = tls_files(config.bus.certificates, name)
            certificate = read_certificate(files.certificate)
            signed = is_signed(files.certificate, files.authority)
        except ConfigError as error:
            text = f"{error.name}: got {error.got}, expected {error.expected}"
            yield Diagnosis("certificate-unusable", BAD, text, error.cause or again)
            continue
        state, days = certificate.state(now), certificate.days_left(now)
        if not signed:
            text = f"that of {name} is not signed by the authority whose certificate is beside it"
            yield Diagnosis("certificate-untrusted", BAD, text, "files of two teams: copy it again")
        elif state == NOT_YET_VALID:
            text = f"that of {name} is not valid before {certificate.begins:%F %T} UTC"
            remedy = "is the clock of this computer right?"
            yield Diagnosis("certificate-not-yet-valid", BAD, text, remedy)
        elif state != VALID:
            text = f"that of {name} expired {-days:.1f} days ago"
            yield Diagnosis("certificate-expired", BAD, text, again)
        elif days < _SOON:
            text = f"that of {name} expires in {days:.1f} days"
            yield Diagnosis("certificate-expiring", NOTE, text, again)
        else:
            good[name] = days
    if good:
        text = f"of {', '.join(good)}: valid for {min(good.values()):.0f} days at least"
        yield Diagnosis("certificate", GOOD, text)


def try_certificate(config: Config, name: str) -> Iterator[Diagnosis]:
    """Whether the router and the certificate of process `name` agree, if it is here."""
    if not (is_tls(config.bus.endpoint) and (Path(config.bus.certificates) / name).is_dir()):
        return
    try:
        check_trust(config.bus, name)
    except QuadrigaError as error:
        if NO_LINK not in error.got:  # the way there is another matter
            code = "expired" if "expired" in error.got else "not-trusted"
            yield Diagnosis(code, BAD, f"{error.name}: {error.got}", error.cause)
    else:
        text = "its certificate here and the router trust each other"
        yield Diagnosis("trusted", GOOD, text)
