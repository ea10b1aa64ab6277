"""SHELL: the certificates that this computer holds, and whether the router and they agree."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final

from quadriga.doctor.certificates import HeldCertificate, check_certificates
from quadriga.shared.bus.diagnostics import BAD, GOOD, Diagnosis
from quadriga.shared.config.endpoints import is_tls
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError, system_reason
from quadriga.shared.runtime.clock import utc_now
from quadriga.shared.security import handshake
from quadriga.shared.security.access import team_identities
from quadriga.shared.security.certificates import EXPIRED as HAS_EXPIRED
from quadriga.shared.security.certificates import (
    NOT_YET_VALID,
    TlsFiles,
    is_signed,
    read_certificate,
    tls_files,
)

TRUSTED: Final = "trusted"
EXPIRED: Final = "expired"  # its certificate here, or the router's
NOT_TRUSTED: Final = "not-trusted"


def look_at_certificates(config: Config) -> tuple[Diagnosis, ...]:
    """What is to be said of the certificates here; nothing of a team without."""
    if not is_tls(config.bus.endpoint):
        return ()
    folder = Path(config.bus.certificates)
    held = [
        _read(who.name, TlsFiles.within(folder / who.name))
        for who in team_identities(config)
        if (folder / who.name).is_dir()
    ]
    return check_certificates(held, utc_now())


def try_certificate(config: Config, name: str) -> Iterator[Diagnosis]:
    """Whether the router and the certificate of process `name` agree, if it is here."""
    folder = Path(config.bus.certificates) / name
    if not (is_tls(config.bus.endpoint) and folder.is_dir()):
        return
    try:
        files = tls_files(config.bus.certificates, name)
        found = handshake.shake_hands(config.bus.endpoint, files)
    except ConfigError as error:
        yield Diagnosis(NOT_TRUSTED, BAD, f"{error.name}: {error.got}", error.cause)
        return
    judged = _judge(found)
    if judged:
        code, text = judged
        verdict = GOOD if code == TRUSTED else BAD
        yield Diagnosis(code, verdict, text, handshake.CAUSES.get(found.outcome, ""))


def _judge(found: handshake.Handshake) -> tuple[str, str] | None:
    """Code and words for what came of a handshake; None: the way there is another matter."""
    if found.outcome == handshake.TRUSTED:
        return TRUSTED, "its certificate here and the router trust each other"
    if found.outcome == HAS_EXPIRED:
        return EXPIRED, f"it does not trust the router: {found.detail}"
    if found.outcome == NOT_YET_VALID:
        return NOT_TRUSTED, f"a certificate is not yet valid: {found.detail}"
    if found.outcome == handshake.UNTRUSTED:
        return NOT_TRUSTED, f"it does not trust the router: {found.detail}"
    if found.outcome == handshake.REFUSED:
        code = EXPIRED if "expired" in found.detail else NOT_TRUSTED
        return code, f"the router does not trust its certificate here: {found.detail}"
    return None


def _read(identity: str, files: TlsFiles) -> HeldCertificate:
    mode: int | None = None
    with suppress(OSError):
        mode = files.key.stat().st_mode & 0o777
    try:
        certificate = read_certificate(files.certificate)
        signed = is_signed(files.certificate, files.authority)
    except ConfigError as error:
        return HeldCertificate(identity, None, key_mode=mode, problem=f"{error.name}: {error.got}")
    except OSError as error:
        return HeldCertificate(identity, None, key_mode=mode, problem=system_reason(error))
    return HeldCertificate(identity, certificate, signed, mode)
