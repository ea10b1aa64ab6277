"""A team's certificates: given once, renewed, and private."""

from __future__ import annotations

import base64
import re
import stat
from datetime import UTC, datetime, timedelta
from pathlib import Path
from shutil import copy, copytree

import pytest

from quadriga.certs.authority import Authority, Pair
from quadriga.certs.folder import CertificateFolder
from quadriga.shared.errors import ConfigError
from quadriga.shared.security.certificates import read_certificate, tls_files

NOW = datetime(2026, 3, 1, 12, tzinfo=UTC)
ROLL = ("r1", "r2", "operator", "router")


@pytest.fixture
def folder(tmp_path: Path) -> CertificateFolder:
    made = CertificateFolder(tmp_path / "certs", ROLL)
    assert made.make("team", ["router.lab", "10.0.0.1"], NOW, 30.0) == [*ROLL]
    return made


def states(folder: CertificateFolder) -> dict[str, str]:
    return {each.identity: each.state(NOW) for each in folder.standings()}


def test_everybody_gets_what_its_process_needs(folder: CertificateFolder) -> None:
    assert states(folder) == dict.fromkeys(ROLL, "valid")
    for name in ROLL:
        files = tls_files(str(folder.path), name)
        assert files.authority.read_bytes() == (folder.path / "authority.pem").read_bytes()


def test_nobody_but_the_owner_reads_a_key(folder: CertificateFolder) -> None:
    keys = [path for path in folder.path.rglob("*") if path.suffix == ".key" or "key" in path.stem]
    assert len(keys) == len(ROLL) + 1
    for path in keys:
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert stat.S_IMODE(folder.path.stat().st_mode) == 0o700


def test_a_key_that_others_can_read_is_refused(folder: CertificateFolder) -> None:
    (folder.path / "r1" / "key.pem").chmod(0o640)
    with pytest.raises(ConfigError, match=r"r1/key\.pem: got mode 640, expected 600"):
        tls_files(str(folder.path), "r1")


def test_a_certificate_that_is_not_there_is_one_clear_error(folder: CertificateFolder) -> None:
    with pytest.raises(ConfigError, match=r"no such file.*that of r9.*certs make"):
        tls_files(str(folder.path), "r9")


@pytest.mark.parametrize("name", ["certificate.pem", "authority.pem", "key.pem"])
def test_an_empty_file_is_named(folder: CertificateFolder, name: str) -> None:
    (folder.path / "r1" / name).write_bytes(b"")
    with pytest.raises(ConfigError, match=rf"r1/{name}: got an empty file"):
        tls_files(str(folder.path), "r1")


def test_what_is_not_pem_is_said_to_be_that(folder: CertificateFolder) -> None:
    (folder.path / "authority.key").write_bytes(b"")
    with pytest.raises(ConfigError, match="authority of the team: got an empty file"):
        folder.renew((), (), NOW, 1.0)
    (folder.path / "r1" / "certificate.pem").write_text("key\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"r1/certificate\.pem: got text that is not PEM"):
        folder.standings()


def test_a_folder_that_was_copied_under_another_name_is_refused(folder: CertificateFolder) -> None:
    """Its process would be let in, and whatever it says denied without a word."""
    copytree(folder.path / "r2", folder.path / "r1", dirs_exist_ok=True)
    with pytest.raises(ConfigError, match=r"got the certificate of 'r2', expected that of r1"):
        tls_files(str(folder.path), "r1")
    assert states(folder)["r1"] == "somebody else's (r2)"


def test_a_certificate_of_another_authority_is_not_valid(
    folder: CertificateFolder, tmp_path: Path
) -> None:
    other = CertificateFolder(tmp_path / "other", ROLL)
    other.make("team", (), NOW, 30.0)
    copy(other.path / "r1" / "certificate.pem", folder.path / "r1" / "certificate.pem")
    assert states(folder) == dict.fromkeys(ROLL, "valid") | {"r1": "another authority's"}


def test_one_not_yet_valid_is_not_expired(folder: CertificateFolder) -> None:
    made = NOW + timedelta(days=2)
    folder.renew(["r1"], (), made, 30.0)
    standing = folder.standings()[0]
    days = (-1, 1, 31)
    found = [standing.state(made + timedelta(days=k)) for k in days]
    assert found == ["not yet valid", "valid", "expired"]


def test_days_are_left_until_it_expires(folder: CertificateFolder) -> None:
    held = read_certificate(folder.path / "r1" / "certificate.pem")
    assert held.days_left(NOW) == pytest.approx(30.0)
    assert held.days_left(NOW + timedelta(days=31)) == pytest.approx(-1.0)


def test_only_the_router_has_addresses_and_keeps_them(folder: CertificateFolder) -> None:
    folder.renew(["router", "r1"], (), NOW, 30.0)
    hosts = {each.identity: each.certificate.hosts for each in folder.standings()}
    assert hosts["router"][:2] == ("router.lab", "10.0.0.1")
    assert {"localhost", "127.0.0.1", "::1"} <= {*hosts["router"]}
    assert not hosts["r1"]
    folder.renew(["router"], ["10.0.0.2"], NOW, 30.0)
    assert folder.standings()[-1].certificate.hosts[0] == "10.0.0.2"


def test_made_again_it_gives_only_those_without_a_valid_one(folder: CertificateFolder) -> None:
    folder.renew(["r2"], (), NOW - timedelta(days=9), 1.0)
    larger = CertificateFolder(folder.path, (*ROLL, "r3"))
    before = (folder.path / "r1" / "certificate.pem").read_bytes()
    assert larger.make("team", (), NOW, 30.0) == ["r2", "r3"]
    assert states(larger) == dict.fromkeys((*ROLL, "r3"), "valid")
    assert (folder.path / "r1" / "certificate.pem").read_bytes() == before


def test_renewed_are_those_that_are_named_or_all(folder: CertificateFolder) -> None:
    assert folder.renew(["r1"], (), NOW, 3.0) == ["r1"]
    days = {s.identity: round(s.certificate.days_left(NOW)) for s in folder.standings()}
    assert days == dict.fromkeys(ROLL, 30) | {"r1": 3}
    assert folder.renew((), (), NOW, 30.0) == [*ROLL]
    with pytest.raises(ConfigError, match="did you mean 'operator'"):
        folder.renew(["operater"], (), NOW, 1.0)


def test_without_the_authority_nothing_is_renewed(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="the authority's key is kept"):
        CertificateFolder(tmp_path, ROLL).renew(["r1"], (), NOW, 1.0)


@pytest.mark.parametrize("host", ["räuter", "*", "a" * 300, "*.lab", "10.0.0.300", "-a.lab", ""])
def test_an_address_that_is_none_is_refused(tmp_path: Path, host: str) -> None:
    with pytest.raises(ConfigError, match=rf"--router: got {re.escape(repr(host[:80]))}"):
        CertificateFolder(tmp_path / "certs", ROLL).make("team", [host], NOW, 1.0)


def packed(pem: bytes) -> bytes:
    return base64.b64decode(b"".join(pem.splitlines()[1:-1]))


def as_pem(content: bytes) -> bytes:
    text = base64.encodebytes(content)
    return b"-----BEGIN CERTIFICATE-----\n" + text + b"-----END CERTIFICATE-----\n"


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"\xa0\x03\x02\x01\x02", b"\xa0\x03\x02\x01\x15"),  # no version that there is
        (b"\x06\x03\x55\x1d\x0f", b"\x06\x03\x55\x1d\x13"),  # an extension twice
        (b"\x0c\x06router", b"\x03\x06\x00outer"),  # a name of bits
    ],
)
def test_a_certificate_that_no_library_takes_is_damaged(
    old: bytes, new: bytes, folder: CertificateFolder
) -> None:
    files = tls_files(str(folder.path), "router")
    content = packed(files.certificate.read_bytes())
    assert content.count(old) == 1
    files.certificate.write_bytes(as_pem(content.replace(old, new)))
    with pytest.raises(ConfigError, match=r"certificate\.pem: got .*, expected a certificate"):
        read_certificate(files.certificate)


def test_a_key_of_a_curve_that_no_library_knows_is_no_authoritys() -> None:
    pair = Authority.create("team", NOW).pair
    body = base64.b64decode(b"".join(pair.key.splitlines()[1:-1]))
    curve = b"\x2a\x86\x48\xce\x3d\x03\x01\x07"
    text = base64.encodebytes(body.replace(curve, curve[:-2] + b"\x01\x63"))
    key = b"-----BEGIN PRIVATE KEY-----\n" + text + b"-----END PRIVATE KEY-----\n"
    with pytest.raises(ConfigError, match="authority of the team"):
        Authority(Pair(pair.certificate, key))
