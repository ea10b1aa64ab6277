"""The processes of docker-compose.yml, each in a network of its own, through the secured router."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from quadriga.certs.folder import CertificateFolder
from quadriga.recordings.check import check
from quadriga.shared.config.load import load
from quadriga.shared.config.write import to_toml
from quadriga.shared.members import DOCTOR, LAST, ROUTER
from quadriga.shared.messages import Command
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.clock import utc_now
from quadriga.shared.security.access import team_identities
from quadriga.team.launch import Launch, ProcessSpec
from tests.deploy.test_compose import SERVICES, TEAM, resolve
from tests.listening import WAIT, await_true
from tests.runtime.namespaces import computers, on, why_not

NAMES = (ROUTER, DOCTOR, LAST, "sim", "r1", "r2", "operator")
SECONDS = 0.6


@pytest.fixture
def addresses() -> Iterator[dict[str, str]]:
    """The computers of the team."""
    reason = why_not()
    if reason:
        pytest.skip(reason)
    with computers(NAMES) as found:
        yield found


def row(service: str, folder: Path) -> ProcessSpec:
    """A service's own command, with the test's configuration, where it is to write, and no page."""
    given = {
        "/etc/quadriga/team.toml": str(folder / "team.toml"),
        "/health": str(folder / "health"),
        "--report": f"--output={folder / 'run.mcap'}",
    }
    words = [resolve(word, TEAM_SIZE="2") for word in SERVICES[service]["command"]]
    command = (sys.executable, "-m", "quadriga", *(given.get(word, word) for word in words))
    return ProcessSpec(service, on(service, command), 20.0)


def write_team(folder: Path, router: str) -> None:
    """The configuration of the containers, with another address, and the team's certificates."""
    keys = {
        "team.robots": 2,
        "bus.endpoint": f"tls/{router}:7447",
        "bus.certificates": str(folder / "certs"),
        "bus.barrier_timeout": WAIT,
        "planner.kind": "none",
        "world.duration": SECONDS,
    }
    config = load(TEAM, keys)
    (folder / "team.toml").write_text(to_toml(config), encoding="utf-8")
    (folder / "health").mkdir()
    certificates = CertificateFolder(
        folder / "certs", [who.name for who in team_identities(config)]
    )
    certificates.make(config.team.name, [router], utc_now(), 1.0)


@pytest.mark.nightly
@pytest.mark.usefixtures("_compiled")
def test_a_team_walks_across_networks_with_certificates(
    addresses: dict[str, str], tmp_path: Path
) -> None:
    write_team(tmp_path, addresses[ROUTER])
    well = tmp_path / "health" / ROUTER
    with Launch([row(name, tmp_path) for name in (ROUTER, DOCTOR)], tmp_path / "logs") as around:
        await_true(
            lambda: well.exists() and well.read_text(encoding="utf-8") == "well\n",
            lambda: (tmp_path / "logs" / "doctor.log").read_text("utf-8"),
        )
        walkers = [row(name, tmp_path) for name in NAMES[2:]]
        with Launch(walkers, tmp_path / "logs") as team:
            team.watch(lambda: False)
        await_true(lambda: not around.alive)  # they leave after the walk
    said = (tmp_path / "logs" / "router.log").read_text(encoding="utf-8")
    assert said.splitlines() == ["routing at tls/0.0.0.0:7447"]
    assert all(finding.passed for finding in check(tmp_path / "run.mcap"))
    recording = Recording(tmp_path / "run.mcap")
    for robot in ("r1", "r2"):
        ticks = [command.tick for command in recording.messages(Command, robot)]
        assert ticks == list(range(round(1000 * SECONDS)))
