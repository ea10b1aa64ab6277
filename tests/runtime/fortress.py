"""A router with certificates, its team's files, and strangers with a stock Zenoh client."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path

import zenoh

from quadriga.certs.folder import secure
from quadriga.shared.bus.session import Bus
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.runtime.clock import utc_now
from quadriga.shared.security.access import router_rules
from quadriga.shared.security.certificates import TlsFiles, tls_files, tls_settings
from quadriga.team.endpoint import free_endpoint

WAIT = 20.0  # s, far more than anything here takes
NOW = utc_now()
LONG_AGO = NOW - timedelta(days=10)


@dataclass(frozen=True)
class Fortress:
    """A team's configuration, with certificates."""

    config: Config

    def files(self, identity: str) -> TlsFiles:
        return tls_files(self.config.bus.certificates, identity)

    def bus(self, name: str) -> Bus:
        """A process of the team."""
        return Bus.open(self.config.bus, self.config.team.name, name)


def make_fortress(folder: Path) -> Fortress:
    """A team of two with certificates for an endpoint of its own."""
    given = {"team.robots": 2, "planner.kind": "none", "bus.endpoint": free_endpoint()}
    return Fortress(secure(load(None, given), folder / "certs", NOW))


@contextmanager
def serving(fortress: Fortress) -> Iterator[None]:
    """The router."""
    config = fortress.config
    rules = router_rules(config)
    with Bus.route(config.bus.endpoint, config.team.name, config.bus, rules):
        yield


@contextmanager
def stranger(fortress: Fortress, files: TlsFiles | None) -> Iterator[zenoh.Session]:
    """A stock Zenoh client at the router, with somebody's files or none."""
    own = dict(tls_settings(files, listens=False)) if files else {}
    authority = str(fortress.files("observer").authority)
    settings = {
        "mode": "client",
        "connect/endpoints": [fortress.config.bus.endpoint],
        "scouting/multicast/enabled": False,
        "connect/timeout_ms": 1000,
        "connect/exit_on_failure": True,
        **own,
        "transport/link/tls/root_ca_certificate": authority,
    }
    config = zenoh.Config()
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    session = zenoh.open(config)
    try:
        yield session
    finally:
        session.close()  # type: ignore[no-untyped-call]
