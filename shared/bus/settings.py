"""Zenoh's settings by role: only the endpoints of the configuration are opened, nothing else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from quadriga.shared.config.endpoints import check_exposure, check_port, is_tls
from quadriga.shared.config.sections import BusConfig
from quadriga.shared.errors import BusError, ConfigError
from quadriga.shared.members import LEADS

NO_LINK: Final = "Unable to connect"  # how Zenoh says that nobody answers at an endpoint
LEASE_MS: Final = 10_000  # of silence after which a link is given up: its process stands still
RECEIVE_BUFFER: Final = 4 << 20  # bytes, of each link's socket
# The others may start before the plant or the router: keep trying in the background.
_RETRY: Final = {"period_init_ms": 20, "period_max_ms": 200, "period_increase_factor": 1.5}
_COMMON: Final = {
    "transport/link/tx/lease": LEASE_MS,
    # Nobody is found by multicast, nothing goes through shared memory.
    "scouting/multicast/enabled": False,
    "transport/shared_memory/enabled": False,
    # Batches that may wait for a link in real time before messages are dropped; with Zenoh's 2 a
    # recorder on a busy machine loses one in a thousand. A batch takes up to 64 kB, unless it is
    # sent at once (`express`): then it is one message, and 16 of them wait where the thread that
    # sends has not run for 10 ms. Words of people and events have a queue of their own, which is
    # empty nearly always.
    "transport/link/tx/queue/size/data": 16,
    "transport/link/tx/queue/size/real_time": 16,
    # Linux counts far more bytes of small messages than they have. Its own buffer is full after
    # 10 ms of a team that walks; then it throws packets away and sends them again 0.2 s later, or
    # later still: a recorder's link has stood still for 3 s. net.core.rmem_max caps this.
    "transport/link/tcp/so_rcvbuf": RECEIVE_BUFFER,
    "transport/link/tls/so_rcvbuf": RECEIVE_BUFFER,
    # ms, of a handshake with someone who says nothing, frozen or just leaving. Nobody can leave
    # before it is over, and Zenoh's 10 s are longer than a process is given.
    "transport/unicast/open_timeout": 2000,
    "transport/unicast/accept_timeout": 2000,
}


def member_settings(bus: BusConfig, name: str, *, hub: bool = False) -> dict[str, Any]:
    """Settings of a process of the team.

    Args:
        bus: the configuration.
        name: of the process; in peer mode the one that drives time is who they all find.
        hub: be who they find although the name is another.

    Raises:
        ConfigError: the endpoint is open to others, or a certificate is missing.
    """
    peer = bus.mode == "peer"
    check_exposure(bus, "bus.endpoint", bus.endpoint)
    if peer:
        check_exposure(bus, "bus.listen", bus.listen)
    hub = peer and (hub or name in LEADS)
    listen = [bus.endpoint] if hub else [bus.listen] if peer else []
    return {
        "mode": bus.mode,
        "connect/endpoints": [] if hub else [bus.endpoint],
        "listen/endpoints": listen,
        "connect/exit_on_failure": False,
        "connect/timeout_ms": -1 if peer else 0,
        "connect/retry": _RETRY,
        "scouting/gossip/enabled": peer,
        **_COMMON,
    }


def router_settings(listen: str, bus: BusConfig, rules: Mapping[str, Any]) -> dict[str, Any]:
    """Settings of the router that clients connect to at endpoint `listen`.

    Args:
        listen: where it listens.
        bus: the configuration.
        rules: what it lets through, as Zenoh is told it.

    Raises:
        ConfigError: the endpoint is open to others, or a certificate is missing.
    """
    check_port("--listen", listen)
    check_exposure(replace(bus, mode="client"), "--listen", listen)
    return {
        "mode": "router",
        "connect/endpoints": [],
        "listen/endpoints": [listen],
        "scouting/gossip/enabled": False,
        **_COMMON,
        **rules,
    }


def link_settings(bus: BusConfig, listen: str, links: Sequence[str]) -> dict[str, Any]:
    """What a router is told besides of the other routers that it connects to.

    Args:
        bus: the configuration.
        listen: where it listens itself.
        links: the endpoints of the others.

    Raises:
        ConfigError: one is open to others, or there are certificates: whoever is linked as a router
            speaks for everybody behind it, so one stolen certificate would command all robots.
    """
    for endpoint in links:
        check_exposure(replace(bus, mode="client"), "--link", endpoint)
        if is_tls(endpoint) or is_tls(listen):
            expected = "one router for all of a team with certificates"
            cause = "the rules are for each process, and a router speaks for all behind it"
            raise ConfigError("--link", f"{endpoint!r} of a router at {listen}", expected, cause)
    retry = {"connect/exit_on_failure": False, "connect/timeout_ms": -1, "connect/retry": _RETRY}
    return {"connect/endpoints": list(links), **retry} if links else {}


def opening_error(settings: dict[str, Any], at: str, name: str, error: str) -> BusError:
    """The error of a process that cannot join the network.

    Args:
        settings: all of Zenoh's.
        at: the last of them that was set.
        name: the process.
        error: Zenoh's words.
    """
    key, endpoint = _key_at_fault(settings, at, error)
    if "in use" in error:
        cause = "another team or program listens there; choose another port"
    elif NO_LINK in error:
        cause = "no router there (`quadriga router`), or a name that does not resolve"
    elif "assign" in error:
        cause = "no interface of this machine has that address; without IPv4, give [::1]"
    else:
        cause = "a name that does not resolve, or not of the form tcp/HOST:PORT"
    where = "sim server" if name in LEADS else name
    return BusError(
        f"{key} {endpoint!r} of {where}",
        error.split(" at /")[0],
        "an endpoint that can be opened",
        cause,
    )


def _key_at_fault(settings: dict[str, Any], at: str, error: str) -> tuple[str, str]:
    """The key of the configuration that Zenoh's error is about, and its value.

    Zenoh often does not say; `at` is the setting that was made last.
    """
    connect, listen = settings["connect/endpoints"], settings["listen/endpoints"]
    if not (connect and listen):
        return "bus.endpoint", (connect or listen)[0]
    # Who listens too connects in the background: only the form and the protocol are checked before.
    protocol = connect[0].partition("/")[0]
    if at == "connect/endpoints" or f"not supported for {protocol} protocol" in error:
        return "bus.endpoint", connect[0]
    return "bus.listen", listen[0]
