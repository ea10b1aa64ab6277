"""Are the certificates that a computer holds good, and for how long?"""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from quadriga.doctor.certificates import HeldCertificate, check_certificates
from quadriga.shared.bus.diagnostics import BAD, GOOD, NOTE
from quadriga.shared.security.certificates import Certificate

NOW = datetime(2026, 11, 26, tzinfo=UTC)


def held(days: float = 100.0, name: str = "r2") -> HeldCertificate:
    end = NOW + timedelta(days=days)
    certificate = Certificate(name, (), end - timedelta(days=365), end)
    return HeldCertificate(name, certificate, signed=True, key_mode=0o600)


def test_good_ones_are_one_line_with_the_first_that_expires() -> None:
    (found,) = check_certificates([held(), held(20.0, "r1")], NOW)
    assert (found.code, found.verdict) == ("certificate", GOOD)
    assert found.text == "certificates of r2, r1: valid for 20 days at least"
    assert check_certificates([], NOW) == ()


@pytest.mark.parametrize(
    ("given", "code", "verdict"),
    [
        (held(6.9), "certificate-expiring", NOTE),
        (held(-0.1), "certificate-expired", BAD),
        (held(400.0), "certificate-not-yet-valid", BAD),
        (replace(held(name="r1"), identity="r2"), "certificate-untrusted", BAD),
        (replace(held(), signed=False), "certificate-untrusted", BAD),
        (replace(held(), key_mode=0o640), "key-open", BAD),
        (replace(held(), key_mode=None), "certificate-unreadable", BAD),
        (HeldCertificate("r2", None, key_mode=0o600, problem="x"), "certificate-unreadable", BAD),
    ],
)
def test_what_is_wrong_is_told_with_what_to_do(
    given: HeldCertificate, code: str, verdict: str
) -> None:
    (found,) = check_certificates([held(name="r1"), given], NOW)
    assert (found.code, found.verdict) == (code, verdict)
    assert "r2" in found.text
    assert found.remedy
