"""Whether a router's rules are in force, asked of the router itself as it starts.

A block of rules that Zenoh does not take as meant is silently nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace
from typing import Final

from quadriga.shared.bus.trespasser import COMING, Lure, Trespasser, going
from quadriga.shared.bus.zenoh_bus import Arrival, Bus
from quadriga.shared.config.endpoints import host_and_port
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError
from quadriga.shared.members import PROBE
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.security.access import ALLOWED, DENIED, LARGE, MANY
from quadriga.shared.security.caps import PROBE_BYTES
from quadriga.shared.security.refusals import Refused

_WAIT: Final = 5.0  # s
_LOOK: Final = 0.01  # s
_AGAIN: Final = 0.2  # s, after which what the router sends the probe is sent again
_LAST: Final = b"last"
_DELETED: Final = b""  # what a deletion carries
_ANY: Final = {"0.0.0.0": "127.0.0.1", "::": "::1"}  # where to reach who listens everywhere


def check_rules(
    bus: Bus, config: Config, listen: str, tell: Callable[[], Collection[Refused]]
) -> None:
    """Connect as the probe: what is permitted arrives, what is not does not, and that is told.

    One of each kind of message is tried, in each direction in which a client can try it.

    Args:
        bus: the router's.
        config: the team's configuration.
        listen: where the router listens.
        tell: tells what has been refused since it was called last.

    Raises:
        BusError: the rules are not in force; it names what was not refused.
    """
    take, lure = bus.collect(f"{bus.team}/{PROBE}/*"), Lure(bus)
    client = replace(config.bus, mode="client", endpoint=_reach(listen))
    with Trespasser.open(client, bus.team, PROBE) as probe:
        _send(probe, ALLOWED, b"first")
        probe.trespass()
        _send(probe, LARGE, bytes(PROBE_BYTES + 1))
        _send(probe, MANY, b"one", b"two", b"three")
        _send(probe, ALLOWED, _LAST)
        _check_arrived(bus.team, _await_last(take))
        _await_told(bus.team, tell, lure)


def _send(probe: Bus, name: str, *payloads: bytes) -> None:
    put = probe.publisher(f"{probe.team}/{PROBE}/{name}")
    for payload in payloads:
        put(payload)


def _await_last(take: Callable[[], list[Arrival]]) -> list[Arrival]:
    arrived, deadline = list[Arrival](), monotonic() + _WAIT
    while not any(payload == _LAST for _, _, payload in arrived):
        if monotonic() > deadline:
            raise _not_in_force(f"nothing from {PROBE} after {_WAIT:g} s", "what is permitted")
        sleep(_LOOK)
        arrived += take()
    return arrived


def _check_arrived(team: str, arrived: list[Arrival]) -> None:
    expected = {ALLOWED: 2, "delete": 0, DENIED: 0, LARGE: 0, MANY: 1}
    counts = dict.fromkeys(expected, 0)
    for _, key, payload in arrived:
        counts["delete" if payload == _DELETED else key.rpartition("/")[2]] += 1
    if counts != expected:
        raise _not_in_force(f"{counts} let through on {team}/{PROBE}", str(expected))


def _await_told(team: str, tell: Callable[[], Collection[Refused]], lure: Lure) -> None:
    wanted, begin, casts = _to_be_told(team), monotonic(), 0
    while wanted:
        now = monotonic() - begin
        if now >= casts * _AGAIN:
            lure.cast()
            casts += 1
        for each in tell():
            if each.who.startswith(f"{PROBE}."):
                wanted.pop((each.action, each.key), None)
        if wanted and now > _WAIT:
            got = f"let through, or refused without a word: {', '.join(wanted.values())}"
            raise _not_in_force(got, "all of it refused, and told")
        sleep(_LOOK)


def _to_be_told(team: str) -> dict[tuple[str, str], str]:
    """By action and key what the router must say that it has refused, for who reads the error."""
    coming = [*COMING.items(), ("put", f"{PROBE}/{LARGE}"), ("put", f"{PROBE}/{MANY}")]
    told = {(kind, f"{team}/{name}"): f"{kind} on {team}/{name}" for kind, name in coming}
    for kind, key in going(team).items():
        told["hear", key] = f"hear {kind} on {key}"
    return told


def _reach(listen: str) -> str:
    host, port = host_and_port(listen)
    host = _ANY.get(host, host)
    return f"tls/[{host}]:{port}" if ":" in host else f"tls/{host}:{port}"


def _not_in_force(got: str, expected: str) -> BusError:
    cause = "another version of Zenoh? The router does not serve"
    return BusError("rules of the router", got, expected, cause)
