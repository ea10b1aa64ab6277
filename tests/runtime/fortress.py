"""A router with certificates, its team's files, and strangers with a stock Zenoh client."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from datetime import timedelta
from pathlib import Path
from typing import Any

import zenoh

from quadriga.certs.folder import CertificateFolder
from quadriga.certs.secured import certificates_of, secure
from quadriga.shared.bus.zenoh_bus import Bus
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import to_toml
from quadriga.shared.runtime.clock import monotonic, sleep, utc_now
from quadriga.shared.security.tls import TlsFiles, tls_files, tls_settings
from quadriga.team.endpoint import free_endpoint

WAIT = 20.0  # s, far more than anything here takes
NOW = utc_now()
LONG_AGO = NOW - timedelta(days=10)


@dataclass
class Fortress:
    """A team's configuration and certificates, and what its router has said."""

    config: Config
    folder: Path
    said: list[str] = field(default_factory=list)

    @property
    def certificates(self) -> CertificateFolder:
        return certificates_of(self.config)

    def files(self, identity: str) -> TlsFiles:
        return tls_files(self.config.bus.certificates, identity)

    def bus(self, name: str) -> Bus:
        """A process of the team."""
        return Bus.open(self.config.bus, self.config.team.name, name)

    def await_said(self, pattern: str, count: int = 1, since: int = 0) -> re.Match[str]:
        """Wait until the router has said something `count` times; the last match."""
        deadline = monotonic() + WAIT
        while True:
            found = [m for line in self.said[since:] if (m := re.search(pattern, line))]
            if len(found) >= count:
                return found[-1]
            assert monotonic() < deadline, f"never {pattern!r} in {self.said}"
            sleep(0.01)


def make_fortress(folder: Path) -> Fortress:
    """A team of two with certificates for an endpoint of its own."""
    given = {"team.robots": 2, "planner.kind": "none", "bus.endpoint": free_endpoint()}
    return Fortress(secure(load(None, given), folder / "certs", NOW), folder)


@contextmanager
def serving(fortress: Fortress) -> Iterator[subprocess.Popen[str]]:
    """The router's process."""
    file = fortress.folder / "config.toml"
    file.write_text(to_toml(fortress.config), encoding="utf-8")
    command = [sys.executable, "-m", "quadriga", "router", "--config", str(file)]
    command += ["--parent", str(os.getpid())]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        errors = process.stderr
        assert errors
        reader = threading.Thread(
            target=lambda: fortress.said.extend(iter(errors.readline, "")), daemon=True
        )
        reader.start()
        try:
            fortress.await_said("routing at tls/")
            yield process
        finally:
            process.terminate()
            process.wait(WAIT)
            reader.join()


def settings_of(fortress: Fortress, files: TlsFiles | None) -> dict[str, Any]:
    """A stock client's settings, with somebody's files or none."""
    own = dict(tls_settings(files, listens=False)) if files else {}
    authority = fortress.files("observer").authority
    return {
        "mode": "client",
        "connect/endpoints": [fortress.config.bus.endpoint],
        "scouting/multicast/enabled": False,
        "connect/timeout_ms": 1000,
        "connect/exit_on_failure": True,
        **own,
        "transport/link/tls/root_ca_certificate": str(authority),
    }


@contextmanager
def stranger(fortress: Fortress, files: TlsFiles | None) -> Iterator[zenoh.Session]:
    """A stock Zenoh client at the router."""
    config = zenoh.Config()
    for key, value in settings_of(fortress, files).items():
        config.insert_json5(key, json.dumps(value))
    session = zenoh.open(config)
    try:
        yield session
    finally:
        session.close()  # type: ignore[no-untyped-call]


def mixed(ours: TlsFiles, theirs: TlsFiles) -> TlsFiles:
    """Who trusts our authority and shows a certificate of theirs."""
    return replace(theirs, authority=ours.authority)
