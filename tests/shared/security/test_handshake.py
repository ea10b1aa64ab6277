"""A real TLS listener: why it is not reached, not trusted, or does not trust us."""

from __future__ import annotations

import socket
import ssl
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime, timedelta
from pathlib import Path
from shutil import copy, copytree

import pytest

from quadriga.certs.folder import CertificateFolder
from quadriga.shared.bus.settings import NO_LINK, check_trust
from quadriga.shared.config.sections import BusConfig
from quadriga.shared.errors import BusError, ConfigError
from quadriga.shared.runtime.clock import wall_ns
from quadriga.shared.security.certificates import tls_files

NOW = datetime.fromtimestamp(1e-9 * wall_ns(), UTC)
ROLL = ("r1", "router")
HERE = "127.0.0.1"


def made(path: Path) -> Path:
    """The certificates of a team, valid for a day."""
    CertificateFolder(path, ROLL).make("team", (), NOW, 1.0)
    return path


@pytest.fixture(scope="module")
def ours(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made(tmp_path_factory.mktemp("ours") / "certs")


def complaint(endpoint: str, certificates: Path) -> str:
    """What is wrong between r1 and who listens there; "": both trust each other."""
    try:
        check_trust(BusConfig(endpoint=endpoint, certificates=str(certificates)), "r1")
    except BusError as error:
        return error.got
    return ""


@contextmanager
def listener(certificates: Path, identity: str = "router", host: str = HERE) -> Iterator[str]:
    """Who shows these files and asks for a certificate of the same authority; its endpoint."""
    files, context = tls_files(str(certificates), identity), ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
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


def test_nobody_listens_or_the_name_does_not_resolve(ours: Path) -> None:
    with socket.create_server((HERE, 0)) as server:
        port = server.getsockname()[1]
    for host in (HERE, "no-such.invalid"):
        assert complaint(f"tls/{host}:{port}", ours).startswith(NO_LINK)


def test_a_listener_is_trusted_if_its_certificate_is_a_router_s_of_ours_and_of_its_address(
    ours: Path, tmp_path: Path
) -> None:
    """A stolen certificate of a robot does not make a router."""
    with listener(ours) as endpoint:
        assert complaint(endpoint, ours) == ""
    others = listener(made(tmp_path / "theirs")), listener(ours, host="127.1.2.3")
    for each in (*others, listener(ours, "r1")):
        with each as endpoint:
            got = complaint(endpoint, ours)
        assert got.startswith("untrusted: ")
        assert ("127.1.2.3" in got) == ("127.1.2.3" in endpoint)


@pytest.mark.parametrize(
    ("renewed", "days", "outcome"),
    [("router", -10, "expired"), ("router", 2, "not yet valid"), ("r1", -10, "refused")],
)
def test_a_certificate_that_is_not_valid_now(
    tmp_path: Path, renewed: str, days: int, outcome: str
) -> None:
    path = made(tmp_path / "certs")
    CertificateFolder(path, ROLL).renew([renewed], (), NOW + timedelta(days=days), 1.0)
    with listener(path) as endpoint:
        assert complaint(endpoint, path).startswith(f"{outcome}: ")


def test_ours_that_is_not_yet_valid_is_called_so_before_anybody_is_asked(tmp_path: Path) -> None:
    path = made(tmp_path / "certs")
    CertificateFolder(path, ROLL).renew(["r1"], (), NOW + timedelta(days=2), 1.0)
    assert complaint("tls/127.0.0.1:1", path).startswith("not yet valid: ours is from ")


def test_our_certificate_is_of_another_authority(ours: Path, tmp_path: Path) -> None:
    mixed = made(tmp_path / "mixed")
    copy(ours / "r1" / "authority.pem", mixed / "r1")
    with listener(ours) as endpoint:
        got = complaint(endpoint, mixed)
    assert got.startswith("refused: ")
    assert "unknown ca" in got


def test_a_key_that_is_not_the_certificate_s(ours: Path, tmp_path: Path) -> None:
    copytree(ours, tmp_path / "mixed")
    copy(ours / "router" / "key.pem", tmp_path / "mixed" / "r1")
    with pytest.raises(ConfigError, match="a certificate, its key"):
        complaint("tls/127.0.0.1:1", tmp_path / "mixed")
