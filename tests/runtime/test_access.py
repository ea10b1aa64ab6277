"""At a router with certificates nobody sends or hears what is not his."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
import zenoh

from quadriga.certs.folder import CertificateFolder
from quadriga.doctor.examine import examine
from quadriga.shared.bus.session import HERE, Arrival, Bus
from quadriga.shared.errors import BusError, ConfigError
from quadriga.shared.security.certificates import TlsFiles, tls_files
from tests.listening import await_true
from tests.runtime.fortress import LONG_AGO, NOW, WAIT, Fortress, make_fortress, serving, stranger

COMMAND, STATE = "team/@link/r1/command", "team/@link/r1/state"
LAST = b"last"  # what comes in last over a link: the rest has come in before, or was refused
FOREIGN = {  # by whose certificate was stolen: keys that are not its owner's
    "r1": ("team/reference", "team/r2/plan", "team/of/strangers", "other/r1/command"),
    "r2": (COMMAND, STATE, "team/r1/command", "team/r1/state", "team/r1/ticks", "team/sim/event"),
    "sim": (COMMAND, "team/r1/command"),
    "operator": (COMMAND, STATE, "team/r1/command"),
    "recorder": (COMMAND, STATE, "team/estop"),
}

EVERYTHING = ("**", "team/**", "team/*/ticks", "team/@link/**", "team/@link/*/state")


@pytest.fixture(scope="module")
def fortress(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fortress]:
    """A team of two, whose router serves."""
    made = make_fortress(tmp_path_factory.mktemp("fortress"))
    with serving(made):
        yield made


@pytest.fixture
def recorder(fortress: Fortress) -> Iterator[Bus]:
    """Hears all that the router lets through."""
    with fortress.bus("recorder") as bus:
        bus.subscribe("team/**")
        yield bus


def heard(fortress: Fortress, recorder: Bus, session: zenoh.Session | None = None) -> set[str]:
    """The keys of all that has been let through until now."""
    if session is not None:  # its own question arrives behind what it has sent
        for _ in session.get("team/recorder/received", timeout=WAIT):
            pass
    with fortress.bus("estop") as bus:
        bus.publisher("team/estop")(LAST)
        keys = set[str]()
        while (packet := recorder.get(WAIT)) != ("team/estop", LAST):
            assert packet, "the last word never came"
            keys.add(packet[0])
    return keys


def bring(put: Callable[[bytes], None], take: Callable[[], list[Arrival]]) -> list[Arrival]:
    """Send a last word; what has come until now."""
    put(LAST)
    return take()


@pytest.mark.parametrize("thief", FOREIGN)
def test_foreign_keys_are_refused(fortress: Fortress, recorder: Bus, thief: str) -> None:
    with (
        fortress.bus("sim") as sim,
        fortress.bus("r1") as agent,
        stranger(fortress, fortress.files(thief)) as session,
    ):
        linked = [sim.collect(COMMAND), agent.collect(STATE)]
        own = [agent.publisher(COMMAND), sim.publisher(STATE)]
        for put, take in zip(own, linked, strict=True):
            await_true(partial(bring, put, take))
        for key in 20 * FOREIGN[thief]:
            session.put(key, bytes(50), congestion_control=zenoh.CongestionControl.BLOCK)
        assert heard(fortress, recorder, session) == set()
        for _ in session.get("team/*/received", target=zenoh.QueryTarget.ALL, timeout=WAIT):
            pass
        assert {payload for take in linked for _, _, payload in take()} <= {LAST}


def test_who_is_let_in_hears_what_is_its_own_alone(fortress: Fortress, recorder: Bus) -> None:
    with fortress.bus("sim") as sim, stranger(fortress, fortress.files("r2")) as session:
        stolen = [session.declare_subscriber(key) for key in EVERYTHING]
        own = session.declare_subscriber("team/@link/r2/state")
        states = [sim.publisher(f"team/@link/{name}/state") for name in ("r1", "r2")]
        await_true(lambda: [put(bytes(50)) for put in states] and own.try_recv())
        assert heard(fortress, recorder, session) == set(), "no state goes to who hears all else"
        samples = [sample for each in stolen for sample in iter(each.try_recv, None)]
        assert {str(sample.key_expr) for sample in samples} <= {"team/@link/r2/state"}


def test_forged_presence_is_seen_by_nobody(fortress: Fortress, recorder: Bus) -> None:
    with stranger(fortress, fortress.files("r2")) as session:
        tokens = [
            session.liveliness().declare_token(f"team/{name}/{HERE}/{session.info.zid()}")
            for name in ("sim", "planner", "r2")
        ]
        assert recorder.wait_for(HERE, ["r2"], WAIT, lambda: False)
        assert recorder.members_at(HERE) == {"r2"}
        for token in tokens:
            token.undeclare()  # type: ignore[no-untyped-call]


def foreign_files(fortress: Fortress, folder: Path, case: str) -> TlsFiles:
    """r1's files, by another team's authority, or by ours for a time that is over."""
    own = fortress.files("r1").authority
    made = CertificateFolder(folder, ("r1",))
    if case == "expired":
        for name in ("authority.pem", "authority.key"):
            top = Path(fortress.config.bus.certificates)
            (folder / name).write_bytes((top / name).read_bytes())
        made.make("team", (), LONG_AGO, 1.0)
    else:
        made.make("team", (), NOW, 1.0)
    files = tls_files(str(folder), "r1")
    files.authority.write_bytes(own.read_bytes())
    return files


@pytest.mark.parametrize("case", ["none", "not-trusted", "expired"])
def test_without_a_certificate_of_the_team_nobody_comes_in(
    fortress: Fortress, recorder: Bus, tmp_path: Path, case: str
) -> None:
    files = None if case == "none" else foreign_files(fortress, tmp_path, case)
    with suppress(zenoh.ZError), stranger(fortress, files) as session:
        for key in ("team/r1/command", "team/estop"):
            session.put(key, bytes(50))
    assert heard(fortress, recorder) == set()
    if files is not None:
        bus = replace(fortress.config.bus, certificates=str(tmp_path))
        with pytest.raises(BusError, match=r"refused: .*`quadriga certs show`"):
            Bus.open(bus, "team", "r1")
        report = examine(replace(fortress.config, bus=bus), here=False)
        (found,) = [m.diagnoses for m in report.members or () if m.name == "r1"]
        assert case in {item.code for item in found}


def test_who_has_no_certificate_does_not_even_try(fortress: Fortress) -> None:
    with pytest.raises(ConfigError, match=r"player/authority\.pem: got no such file"):
        fortress.bus("player")
