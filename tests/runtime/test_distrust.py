"""Why a process of a team with certificates is not there: by the doctor, and at the barrier."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from quadriga.certs.folder import CertificateFolder
from quadriga.doctor.examine import examine
from quadriga.doctor.report import DoctorReport, to_json
from quadriga.shared.bus.barrier import await_members
from quadriga.shared.bus.introduction import Introduction
from quadriga.shared.bus.watch import Watch
from quadriga.shared.bus.zenoh_bus import HERE, Bus
from quadriga.shared.errors import BusError
from quadriga.shared.runtime.clock import utc_now
from tests.runtime.fortress import LONG_AGO, NOW, WAIT, Fortress, make_fortress, serving, stranger


@pytest.fixture(scope="module")
def fortress(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fortress]:
    """A router that serves a team of two; r2's first certificate has been revoked."""
    made = make_fortress(tmp_path_factory.mktemp("fortress"))
    made.config = replace(made.config, bus=replace(made.config.bus, barrier_timeout=1.0))
    made.certificates.revoke(["r2"])
    with serving(made):
        yield made


@pytest.fixture(scope="module")
def sim(fortress: Fortress) -> Iterator[Bus]:
    """The first of the team, which waits for the others."""
    with fortress.bus("sim") as bus:
        Introduction(bus, fortress.config)
        bus.declare(HERE)
        yield bus


def codes(report: DoctorReport) -> dict[str, list[str]]:
    return {m.name: [item.code for item in m.diagnoses] for m in report.members or ()}


def texts(report: DoctorReport, name: str) -> str:
    (found,) = [m.diagnoses for m in report.members or () if m.name == name]
    return "; ".join(item.text for item in found)


def explain(fortress: Fortress, sim: Bus, name: str) -> str:
    """What the barrier says of one who does not come."""
    config = replace(fortress.config, bus=replace(fortress.config.bus, barrier_timeout=0.1))
    with pytest.raises(BusError) as caught:
        await_members(sim, config, HERE, {name}, lambda: False)
    return caught.value.cause


def test_a_revoked_process_is_told_so_by_all_and_sees_itself_that_nobody_answers(
    fortress: Fortress, sim: Bus
) -> None:
    with fortress.bus("r2") as r2:
        r2.declare(HERE)
        fortress.await_said(r"refused: r2\.1: liveliness token .*\(revoked")
        report = examine(fortress.config, here=False)
        own = Watch(r2, fortress.config, HERE, {"sim"}, lambda: None).explain({"sim"})
        assert explain(fortress, sim, "r2").startswith("r2: its certificate r2.1 is revoked (")
    assert codes(report)["r2"] == ["revoked"]
    assert codes(report)["sim"] == ["here"]
    assert "`quadriga certs renew r2`" in to_json(report)
    assert "certificate-revoked" in {item.code for item in report.here}
    assert "the router does not answer this process, although they are linked" in own


def test_an_expired_certificate_is_told_from_both_sides(fortress: Fortress, sim: Bus) -> None:
    fortress.certificates.renew(["operator"], (), LONG_AGO, 1.0)
    command = [sys.executable, "-m", "quadriga", "operate"]
    file = str(fortress.folder / "config.toml")
    done = subprocess.run(
        [*command, "--config", file], capture_output=True, text=True, timeout=WAIT, check=False
    )
    assert done.returncode == 2
    assert "certificate expired" in done.stderr
    fortress.await_said(r"refused: somebody: connect: .*xpired.*\(untrusted")
    report = examine(fortress.config, here=False)
    assert codes(report)["operator"] == ["not-started", "expired"]
    assert "the router does not trust its certificate here" in texts(report, "operator")
    assert "the router has not let in somebody: " in report.router[0].text
    assert (report.router[0].code, report.router[0].verdict) == ("not-trusted", "bad")
    assert "certificate-expired" in {item.code for item in report.here}
    said = explain(fortress, sim, "operator")
    assert "operator: not on the bus" in said
    assert "the router has not let in somebody" in said
    assert "xpired" in said


def test_a_certificate_of_another_authority_is_told_from_both_sides(
    fortress: Fortress, sim: Bus, tmp_path: Path
) -> None:
    theirs = CertificateFolder(tmp_path / "certs", ("recorder", "doctor"))
    theirs.make("team", (), NOW, 1.0)
    config = replace(fortress.config.bus, certificates=str(theirs.path))
    report = examine(replace(fortress.config, bus=config), here=False)
    assert codes(report)["recorder"] == ["no-link", "not-trusted"]
    assert "it does not trust the router" in texts(report, "recorder")
    assert "untrusted" in report.link.text
    (path := theirs.path / "recorder" / "authority.pem").write_bytes(
        fortress.files("r1").authority.read_bytes()
    )
    report = examine(replace(fortress.config, bus=config), here=False)
    assert "the router does not trust its certificate here" in texts(report, "recorder")
    found = {item.code: item.text for item in report.here}
    assert "recorder.1 is not signed by the authority" in found["certificate-untrusted"]
    path.parent.joinpath("key.pem").chmod(0o640)
    report = examine(replace(fortress.config, bus=config), here=True)
    assert "mode 640" in {item.code: item.text for item in report.here}["key-open"]


def test_who_was_denied_a_key_is_told_with_it(fortress: Fortress, sim: Bus) -> None:
    with stranger(fortress, fortress.files("r1")) as session:
        session.put("team/r2/plan", bytes(500))
        fortress.await_said(r"refused: r1\.1: put team/r2/plan \(denied")
        body: dict[str, Any] = json.loads(to_json(examine(fortress.config, here=False)))
    assert not body["well"]
    (found,) = [m["diagnoses"] for m in body["members"] if m["name"] == "r1"]
    assert [item["code"] for item in found] == ["denied", "not-started", "trusted"]
    assert found[0]["text"].startswith("denied put team/r2/plan (once ")


def test_a_link_whose_certificate_expires_is_closed_and_told(fortress: Fortress, sim: Bus) -> None:
    fortress.certificates.renew(["r2"], (), utc_now(), 2.0 / 86_400.0)
    with fortress.bus("r2") as r2:
        r2.declare(HERE)
        assert sim.wait_for(HERE, {"r2"}, WAIT, lambda: False)
        fortress.await_said(r"refused: r2\.2: stay connected \(expired, 1 times")
        report = examine(fortress.config, here=False)
        own = Watch(r2, fortress.config, HERE, {"sim"}, lambda: None).explain({"sim"})
    assert "r2" not in sim.members_at(HERE)
    assert "expired" in codes(report)["r2"]
    assert "its certificate r2.2 has expired, and its link was closed" in texts(report, "r2")
    assert "expired" in own
