"""Are the certificates that a computer holds good, and for how long?"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from shutil import copy, copytree

import pytest

from quadriga.certs.folder import CertificateFolder
from quadriga.doctor.certificates import check_certificates
from quadriga.shared.bus.diagnostics import BAD, GOOD, NOTE
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.runtime.places import SOURCE

NOW = datetime(2026, 11, 26, tzinfo=UTC)
Spoil = Callable[[CertificateFolder], object]


@pytest.fixture
def folder(tmp_path: Path) -> CertificateFolder:
    """Of r1 and r2 that have a certificate for a hundred days."""
    made = CertificateFolder(tmp_path / "certs", ("r1", "r2"))
    made.make("team", (), NOW, 100.0)
    return made


def of_team(folder: CertificateFolder) -> Config:
    config = load(None, {"team.robots": 2})
    bus = replace(config.bus, endpoint="tls/127.0.0.1:1", certificates=str(folder.path))
    return replace(config, bus=bus)


def days_from_now(begin: float, days: float) -> Spoil:
    return lambda folder: folder.renew(["r2"], (), NOW + timedelta(days=begin), days)


def of_another_authority(folder: CertificateFolder) -> None:
    other = CertificateFolder(folder.path.parent / "other", ("r2",))
    other.make("team", (), NOW, 100.0)
    copy(other.path / "r2" / "certificate.pem", folder.path / "r2")


def test_good_ones_are_one_line_with_the_first_that_expires(folder: CertificateFolder) -> None:
    folder.renew(["r1"], (), NOW, 20.0)
    (found,) = check_certificates(of_team(folder), NOW)
    assert (found.code, found.verdict) == ("certificate", GOOD)
    assert found.text == "of r1, r2: valid for 20 days at least"
    empty = CertificateFolder(folder.path / "none", ())
    assert not [*check_certificates(of_team(empty), NOW)]


@pytest.mark.parametrize(
    ("spoil", "code", "verdict"),
    [
        (days_from_now(0.0, 6.9), "expiring", NOTE),
        (days_from_now(-9.1, 9.0), "expired", BAD),
        (days_from_now(30.0, 100.0), "not-yet-valid", BAD),
        (of_another_authority, "untrusted", BAD),
        (lambda f: copytree(f.path / "r1", f.path / "r2", dirs_exist_ok=True), "unusable", BAD),
        (lambda f: (f.path / "r2/key.pem").chmod(0o640), "unusable", BAD),
        (lambda f: (f.path / "r2/key.pem").unlink(), "unusable", BAD),
        (lambda f: (f.path / "r2/certificate.pem").write_text("x"), "unusable", BAD),
    ],
)
def test_what_is_wrong_is_told_with_what_to_do(
    folder: CertificateFolder, spoil: Spoil, code: str, verdict: str
) -> None:
    spoil(folder)
    found, good = check_certificates(of_team(folder), NOW)
    assert (found.code, found.verdict) == (f"certificate-{code}", verdict)
    assert f"`{found.code}`" in (SOURCE / "docs" / "doctor.md").read_text(encoding="utf-8")
    assert "r2" in found.text
    assert found.remedy
    assert (good.code, good.verdict) == ("certificate", GOOD)
