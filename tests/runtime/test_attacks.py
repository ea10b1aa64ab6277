"""A stranger with a stock Zenoh client, with and without a certificate that is not its own.

All attack one router. A recorder hears everything that gets through, and nothing may.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from dataclasses import replace
from pathlib import Path

import pytest
import zenoh

from quadriga.certs.folder import CertificateFolder
from quadriga.shared.bus.zenoh_bus import HERE, READY, Bus
from quadriga.shared.errors import BusError
from quadriga.shared.members import ESTOP as STOPPER
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.security.caps import capacity, largest
from quadriga.shared.security.markdown import PAGE
from quadriga.shared.security.tls import TlsFiles, tls_files, tls_settings
from quadriga.shared.wire.codec import decode, encode
from quadriga.shared.wire.messages import EStop, Event, Reference, Refusal
from quadriga.shared.wire.topics import COMMAND, ESTOP, REFUSED
from quadriga.team.endpoint import free_endpoint
from tests.runtime.fortress import (
    LONG_AGO,
    NOW,
    WAIT,
    Fortress,
    make_fortress,
    mixed,
    serving,
    stranger,
)

TRIES = 20
STOP = encode(Event.of(1 << 41, "signal", "", "told to stop"))
FAST = encode(Reference(0, 0, 2.0, 0.0, 0.0, 0.3))
LAST = EStop(0, 0, "the last word")
ATTACKS = (  # whose certificate was stolen, and what is sent with it, or without any
    ("r2", "team/r1/command", bytes(500)),
    ("r2", "team/r1/state", bytes(500)),
    ("operator", "team/r1/command", bytes(500)),
    ("operator", "team/sim/event", STOP),
    ("r1", "team/reference", FAST),
    ("r1", "team/r2/plan", bytes(500)),
    ("sim", "team/r1/command", bytes(500)),
    ("recorder", "team/estop", encode(EStop(0, 0, "forged"))),
    ("observer", "team/reference", FAST),
    ("launcher", "team/refused", bytes(50)),
    ("r1", "team/of/strangers", bytes(50)),
)


@pytest.fixture(scope="module")
def fortress(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fortress]:
    """A router that serves a team of two; the planner's certificate has been revoked."""
    made = make_fortress(tmp_path_factory.mktemp("fortress"))
    made.certificates.revoke(["planner"])
    with serving(made):
        yield made


@pytest.fixture(scope="module")
def recorder(fortress: Fortress) -> Iterator[Bus]:
    """Hears all that the router lets through."""
    with fortress.bus("recorder") as bus:
        bus.subscribe("team/**")
        yield bus


def heard(fortress: Fortress, recorder: Bus) -> list[tuple[str, bytes]]:
    """All that has been let through until now; what the team itself sends comes last."""
    packets: list[tuple[str, bytes]] = []
    with fortress.bus(STOPPER) as bus:
        bus.publisher(ESTOP.key("team"))(encode(LAST))
        while True:
            packet = recorder.get(WAIT)
            assert packet, "the last word never came"
            if packet == (ESTOP.key("team"), encode(LAST)):
                return packets
            packets.append(packet)


def refusals(packets: list[tuple[str, bytes]]) -> list[Refusal]:
    """What the router has told the team, beside which nothing may have come."""
    assert {key for key, _ in packets} <= {REFUSED.key("team")}
    return [decode(payload, Refusal) for _, payload in packets]


def await_refused(fortress: Fortress, since: int, who: str, key: str, word: str) -> int:
    """Wait until a refusal has been told `TRIES` times; how often it was."""
    line = re.compile(rf"refused: {who}: .* {re.escape(key)} \((?:{word}), (\d+) times\)")
    deadline = monotonic() + WAIT
    while True:
        told = sum(int(m[1]) for said in fortress.said[since:] if (m := line.search(said)))
        if told >= TRIES:
            return told
        assert monotonic() < deadline, f"{told} of {who} {key} in {fortress.said[since:]}"
        sleep(0.01)


def test_the_page_lists_every_attack() -> None:
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    for thief, key, _ in ATTACKS:
        short = key.removeprefix("team/")
        assert any(f"| `{short}` |" in line and f"`{thief}`" in line for line in lines), short


@pytest.mark.parametrize(("thief", "key", "payload"), ATTACKS)
@pytest.mark.parametrize("declared", [False, True])
def test_a_stolen_certificate_sends_what_its_owner_may_and_nothing_else(
    fortress: Fortress, recorder: Bus, thief: str, key: str, payload: bytes, declared: bool
) -> None:
    since = len(fortress.said)
    with stranger(fortress, fortress.files(thief)) as session:
        block = zenoh.CongestionControl.BLOCK  # by default a busy machine would drop some here
        publisher = session.declare_publisher(key, congestion_control=block) if declared else None
        for _ in range(TRIES):
            if publisher is None:
                session.put(key, payload, congestion_control=block)
            else:
                publisher.put(payload)
        assert await_refused(fortress, since, f"{thief}.1", key, "denied|often") == TRIES
        told = refusals(heard(fortress, recorder))
    assert sum(each.count for each in told if each.key == key) == TRIES
    assert {each.who for each in told} == {f"{thief}.1"}


def test_a_stolen_certificate_sends_nothing_under_another_team_s_name(
    fortress: Fortress, recorder: Bus
) -> None:
    """Not declared: a declared publisher sends nothing once it knows that nobody listens."""
    since, key = len(fortress.said), "other/r1/command"
    with stranger(fortress, fortress.files("r1")) as session:
        for _ in range(TRIES):
            session.put(key, bytes(500), congestion_control=zenoh.CongestionControl.BLOCK)
        assert await_refused(fortress, since, "r1.1", key, "denied") == TRIES
        told = refusals(heard(fortress, recorder))
    assert [(each.who, each.key) for each in told] == [("r1.1", key)] * len(told)
    assert sum(each.count for each in told) == TRIES


def test_a_stolen_certificate_hears_what_its_owner_may_and_nothing_else(
    fortress: Fortress, recorder: Bus
) -> None:
    secrets = ("team/**", "team/r1/state", "team/*/command", "**")
    since = len(fortress.said)
    with fortress.bus("sim") as sim, stranger(fortress, fortress.files("r2")) as session:
        stolen = [session.declare_subscriber(key) for key in secrets]
        own = session.declare_subscriber("team/r2/state")
        for key in secrets:
            fortress.await_said(
                rf"refused: r2\.1: declare subscriber {re.escape(key)} \(denied", since=since
            )
        states = {key: sim.publisher(f"team/{key}/state") for key in ("r1", "r2")}
        for put in states.values():
            for _ in range(TRIES):
                put(bytes(500))
        assert str(own.recv().key_expr) == "team/r2/state", "what it may hear, it hears"
        passed = {key for key, _ in heard(fortress, recorder)}
        assert {"team/r1/state", "team/r2/state"} <= passed
        told = [sample for each in stolen for sample in iter(each.try_recv, None)]
        assert {str(sample.key_expr) for sample in told} <= {"team/r2/state"}


def knock(fortress: Fortress, files: TlsFiles | None) -> None:
    """Try to come in and all attacks. Zenoh may say that it is in although it is not."""
    with suppress(zenoh.ZError), stranger(fortress, files) as session:
        for _, key, payload in ATTACKS:
            session.put(key, payload)


def test_without_a_certificate_nobody_comes_in(fortress: Fortress, recorder: Bus) -> None:
    since = len(fortress.said)
    knock(fortress, None)
    fortress.await_said(r"refused: somebody: connect: .*\(untrusted", since=since)
    refusals(heard(fortress, recorder))


def test_with_a_certificate_of_another_authority_nobody_comes_in(
    fortress: Fortress, recorder: Bus, tmp_path: Path
) -> None:
    theirs = CertificateFolder(tmp_path / "theirs", ("r1",))
    theirs.make("team", (), NOW, 1.0)
    since = len(fortress.said)
    knock(fortress, mixed(fortress.files("r1"), tls_files(str(theirs.path), "r1")))
    fortress.await_said(r"refused: somebody: connect: .*\(untrusted", since=since)
    refusals(heard(fortress, recorder))


def test_with_an_expired_certificate_nobody_comes_in(fortress: Fortress, recorder: Bus) -> None:
    since = len(fortress.said)
    fortress.certificates.renew(["launcher"], (), LONG_AGO, 1.0)
    knock(fortress, fortress.files("launcher"))
    fortress.await_said(r"refused: somebody: connect: .*\(untrusted", since=since)
    refusals(heard(fortress, recorder))
    with pytest.raises(BusError, match=r"refused: .*expired.*`quadriga certs show`"):
        fortress.bus("launcher")


def test_a_revoked_certificate_may_do_nothing(fortress: Fortress, recorder: Bus) -> None:
    since = len(fortress.said)
    with stranger(fortress, fortress.files("planner")) as session:
        for _ in range(TRIES):
            session.put("team/r1/plan", bytes(500))
        await_refused(fortress, since, "planner.1", "team/r1/plan", "revoked")
        refusals(heard(fortress, recorder))


def test_a_message_that_is_too_large_stops_at_the_router(fortress: Fortress, recorder: Bus) -> None:
    since, limit = len(fortress.said), largest(COMMAND.type)
    with stranger(fortress, fortress.files("r2")) as session:
        for size in (limit + 1, 1 << 19):
            for _ in range(TRIES):
                session.put("team/r2/command", bytes(size))
        assert await_refused(fortress, since, "r2.1", "team/r2/command", "large") >= TRIES
        refusals(heard(fortress, recorder))


def test_a_message_larger_than_any_reaches_nobody(fortress: Fortress, recorder: Bus) -> None:
    with stranger(fortress, fortress.files("r2")) as session:
        session.put("team/r2/command", bytes(100_000_000))
        refusals(heard(fortress, recorder))


def test_one_certificate_does_not_take_all_sessions(fortress: Fortress, recorder: Bus) -> None:
    most = capacity(fortress.config)["transport/unicast/max_sessions"]
    since, opened = len(fortress.said), 0
    with ExitStack() as stack:
        for _ in range(most + 2):
            with suppress(zenoh.ZError):
                stack.enter_context(stranger(fortress, fortress.files("r2")))
                opened += 1
        fortress.await_said(r"refused: r2\.1: connect \(full", since=since)
    assert opened < most


def test_forged_presence_is_seen_by_nobody(fortress: Fortress, recorder: Bus) -> None:
    """A robot's certificate announces the world, the planner and itself; only the last is true."""
    recorder.declare(HERE)
    with (
        stranger(fortress, fortress.files("r2")) as session,
        stranger(fortress, fortress.files("planner")) as revoked,
    ):
        zid = session.info.zid()
        tokens = [
            session.liveliness().declare_token(f"team/{name}/{stage}/{zid}")
            for name in ("sim", "planner", "r2")
            for stage in (HERE, READY)
        ]
        tokens.append(revoked.liveliness().declare_token(f"team/planner/{HERE}/{zid}"))
        assert recorder.wait_for(READY, ["r2"], WAIT, lambda: False)
        heard(fortress, recorder)
        assert recorder.members_at(HERE) & {"sim", "planner"} == frozenset()
        for token in tokens:
            token.undeclare()  # type: ignore[no-untyped-call]


def test_a_stolen_certificate_of_a_robot_makes_no_router(fortress: Fortress) -> None:
    """Who listens with it is not trusted by those who connect."""
    thief = fortress.files("r2")
    endpoint = free_endpoint().replace("tcp/", "tls/")
    config = zenoh.Config()
    settings = {"mode": "router", "listen/endpoints": [endpoint]} | dict(
        tls_settings(thief, listens=True)
    )
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    with zenoh.open(config), pytest.raises(BusError, match="untrusted"):
        Bus.open(replace(fortress.config.bus, endpoint=endpoint), "team", "r1")
