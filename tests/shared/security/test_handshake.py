"""A real TLS listener: why it is not reached, not trusted, or does not trust us."""

from __future__ import annotations

import socket
import ssl
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from quadriga.certs.folder import CertificateFolder
from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.clock import wall_ns
from quadriga.shared.security.certificates import EXPIRED, NOT_YET_VALID, TlsFiles, tls_files
from quadriga.shared.security.handshake import (
    CAUSES,
    REFUSED,
    TRUSTED,
    UNREACHABLE,
    UNTRUSTED,
    shake_hands,
)

NOW = datetime.fromtimestamp(1e-9 * wall_ns(), UTC)
ROLL = ("r1", "router")


def made(path: Path) -> Path:
    """The certificates of a team, valid for a day."""
    CertificateFolder(path, ROLL).make("team", (), NOW, 1.0)
    return path


@pytest.fixture(scope="module")
def ours(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made(tmp_path_factory.mktemp("ours") / "certs")


@contextmanager
def listener(files: TlsFiles, host: str = "127.0.0.1") -> Iterator[str]:
    """Who shows these files and asks for a certificate of the same authority; its endpoint."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(files.certificate, files.key)
    context.load_verify_locations(files.authority)
    context.verify_mode = ssl.CERT_REQUIRED
    with socket.create_server((host, 0)) as server:

        def serve() -> None:
            with suppress(OSError):
                link, _ = server.accept()
                with link, context.wrap_socket(link, server_side=True) as secured:
                    secured.recv(1)

        thread = threading.Thread(target=serve)
        thread.start()
        yield f"tls/{host}:{server.getsockname()[1]}"
        thread.join()


def files_of(certificates: Path, identity: str) -> TlsFiles:
    return tls_files(str(certificates), identity)


def test_both_trust_each_other(ours: Path) -> None:
    with listener(files_of(ours, "router")) as endpoint:
        assert shake_hands(endpoint, files_of(ours, "r1")).outcome == TRUSTED


def test_nobody_listens_or_the_name_does_not_resolve(ours: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    for host in ("127.0.0.1", "no-such.invalid"):
        assert shake_hands(f"tls/{host}:{port}", files_of(ours, "r1")).outcome == UNREACHABLE


def test_a_listener_of_another_authority(ours: Path, tmp_path: Path) -> None:
    with listener(files_of(made(tmp_path / "theirs"), "router")) as endpoint:
        assert shake_hands(endpoint, files_of(ours, "r1")).outcome == UNTRUSTED


def test_a_listener_whose_certificate_is_for_another_address(ours: Path) -> None:
    with listener(files_of(ours, "router"), "127.1.2.3") as endpoint:
        found = shake_hands(endpoint, files_of(ours, "r1"))
    assert found.outcome == UNTRUSTED
    assert "127.1.2.3" in found.detail


def test_a_listener_with_the_certificate_of_who_connects(ours: Path) -> None:
    """A stolen certificate of a robot does not make a router."""
    with listener(files_of(ours, "r1")) as endpoint:
        assert shake_hands(endpoint, files_of(ours, "r1")).outcome == UNTRUSTED


@pytest.mark.parametrize(
    ("renewed", "days", "outcome"),
    [("router", -10, EXPIRED), ("router", 2, NOT_YET_VALID), ("r1", -10, REFUSED)],
)
def test_a_certificate_that_is_not_valid_now(
    tmp_path: Path, renewed: str, days: int, outcome: str
) -> None:
    path = made(tmp_path / "certs")
    CertificateFolder(path, ROLL).renew([renewed], (), NOW + timedelta(days=days), 1.0)
    with listener(files_of(path, "router")) as endpoint:
        assert shake_hands(endpoint, files_of(path, "r1")).outcome == outcome
    assert outcome in CAUSES


def test_ours_that_is_not_yet_valid_is_called_so_before_anybody_is_asked(tmp_path: Path) -> None:
    path = made(tmp_path / "certs")
    CertificateFolder(path, ROLL).renew(["r1"], (), NOW + timedelta(days=2), 1.0)
    found = shake_hands("tls/127.0.0.1:1", files_of(path, "r1"))
    assert (found.outcome, found.detail[:13]) == (NOT_YET_VALID, "ours is from ")


def test_our_certificate_is_of_another_authority(ours: Path, tmp_path: Path) -> None:
    theirs = made(tmp_path / "theirs")
    mixed = TlsFiles(
        files_of(ours, "r1").authority,
        files_of(theirs, "r1").certificate,
        files_of(theirs, "r1").key,
    )
    with listener(files_of(ours, "router")) as endpoint:
        found = shake_hands(endpoint, mixed)
    assert found.outcome == REFUSED
    assert "unknown ca" in found.detail


def test_a_key_that_is_not_the_certificate_s(ours: Path) -> None:
    ours_r1, router = files_of(ours, "r1"), files_of(ours, "router")
    with pytest.raises(ConfigError, match="a certificate, its key"):
        shake_hands("tls/127.0.0.1:1", TlsFiles(ours_r1.authority, ours_r1.certificate, router.key))
