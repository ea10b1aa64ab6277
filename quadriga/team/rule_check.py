"""Whether a router's rules are in force, asked of the router itself as it starts.

A block of rules that Zenoh does not take as meant is silently nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace
from typing import Final

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
_LAST: Final = b"last"
_REFUSED: Final = (DENIED, LARGE, MANY)
_ANY: Final = {"0.0.0.0": "127.0.0.1", "::": "::1"}  # where to reach who listens everywhere


def check_rules(
    bus: Bus, config: Config, listen: str, tell: Callable[[], Collection[Refused]]
) -> None:
    """Connect as the probe: what is permitted arrives, what is not does not, and that is told.

    Args:
        bus: the router's.
        config: the team's configuration.
        listen: where the router listens.
        tell: tells what has been refused since it was called last.

    Raises:
        BusError: the rules are not in force.
    """
    take = bus.collect(f"{bus.team}/{PROBE}/*")
    client = replace(config.bus, mode="client", endpoint=_reach(listen))
    with Bus.open(client, bus.team, PROBE) as probe:
        for name, payloads in (
            (ALLOWED, [b"first"]),
            (DENIED, [b"denied"]),
            (LARGE, [bytes(PROBE_BYTES + 1)]),
            (MANY, [b"one", b"two", b"three"]),
            (ALLOWED, [_LAST]),
        ):
            put = probe.publisher(f"{bus.team}/{PROBE}/{name}")
            for payload in payloads:
                put(payload)
        arrived = _await_last(take)
        _check_arrived(bus.team, arrived)
        _await_told(bus.team, tell)


def _await_last(take: Callable[[], list[Arrival]]) -> list[Arrival]:
    arrived, deadline = list[Arrival](), monotonic() + _WAIT
    while not any(payload == _LAST for _, _, payload in arrived):
        if monotonic() > deadline:
            raise _not_in_force(f"nothing from {PROBE} after {_WAIT:g} s", "what is permitted")
        sleep(_LOOK)
        arrived += take()
    return arrived


def _check_arrived(team: str, arrived: list[Arrival]) -> None:
    counts = {name: 0 for name in (ALLOWED, *_REFUSED)}
    for _, key, _ in arrived:
        counts[key.rpartition("/")[2]] += 1
    expected = {ALLOWED: 2, DENIED: 0, LARGE: 0, MANY: 1}
    if counts != expected:
        raise _not_in_force(f"{counts} let through on {team}/{PROBE}", str(expected))


def _await_told(team: str, tell: Callable[[], Collection[Refused]]) -> None:
    wanted, deadline = {f"{team}/{PROBE}/{name}" for name in _REFUSED}, monotonic() + _WAIT
    while wanted:
        wanted -= {refused.key for refused in tell() if refused.who.startswith(f"{PROBE}.")}
        if wanted and monotonic() > deadline:
            got = f"no word of what was refused on {', '.join(sorted(wanted))}"
            raise _not_in_force(got, "every refusal told")
        sleep(_LOOK)


def _reach(listen: str) -> str:
    host, port = host_and_port(listen)
    host = _ANY.get(host, host)
    return f"tls/[{host}]:{port}" if ":" in host else f"tls/{host}:{port}"


def _not_in_force(got: str, expected: str) -> BusError:
    cause = "another version of Zenoh? The router does not serve"
    return BusError("rules of the router", got, expected, cause)
