"""Zenoh's settings by role: only the endpoints of the configuration are opened, nothing else."""

from __future__ import annotations

from typing import Any, Final

from quadriga.shared.bus.members import SIM
from quadriga.shared.config.sections import BusConfig

_COMMON: Final = {
    # Nobody is found by multicast, nothing goes through shared memory.
    "scouting/multicast/enabled": False,
    "transport/shared_memory/enabled": False,
    # Messages that may wait for a link in real time before they are dropped. With Zenoh's 2 a
    # recorder on a busy machine loses one in a thousand.
    "transport/link/tx/queue/size/data": 16,
    # ms, of a handshake with someone who says nothing, frozen or just leaving. Nobody can leave
    # before it is over, and Zenoh's 10 s are longer than a process is given.
    "transport/unicast/open_timeout": 2000,
    "transport/unicast/accept_timeout": 2000,
}


def member_settings(bus: BusConfig, name: str, *, hub: bool = False) -> dict[str, Any]:
    """Settings of a process of the team.

    Args:
        bus: the configuration.
        name: of the process; in peer mode the one named `sim` is who they all find.
        hub: be who they find although the name is another.
    """
    peer = bus.mode == "peer"
    hub = peer and (hub or name == SIM)
    listen = [bus.endpoint] if hub else [bus.listen] if peer else []
    return {
        "mode": bus.mode,
        "connect/endpoints": [] if hub else [bus.endpoint],
        "listen/endpoints": listen,
        # The others may start before the sim server or the router: keep trying in the background.
        "connect/exit_on_failure": False,
        "connect/timeout_ms": -1 if peer else 0,
        "connect/retry": {
            "period_init_ms": 20,
            "period_max_ms": 200,
            "period_increase_factor": 1.5,
        },
        "scouting/gossip/enabled": peer,
        **_COMMON,
    }


def router_settings(listen: str) -> dict[str, Any]:
    """Settings of the router that clients connect to at endpoint `listen`."""
    return {
        "mode": "router",
        "connect/endpoints": [],
        "listen/endpoints": [listen],
        "scouting/gossip/enabled": False,
        **_COMMON,
    }


def at_fault(settings: dict[str, Any], at: str, error: str) -> tuple[str, str]:
    """The key of the configuration that Zenoh's error is about, and its value.

    Args:
        settings: all of Zenoh's.
        at: the last of them that was set.
        error: Zenoh's words, which often do not say.
    """
    connect, listen = settings["connect/endpoints"], settings["listen/endpoints"]
    if not (connect and listen):
        return "bus.endpoint", (connect or listen)[0]
    # Who listens too connects in the background: only the form and the protocol are checked before.
    protocol = connect[0].partition("/")[0]
    if at == "connect/endpoints" or f"not supported for {protocol} protocol" in error:
        return "bus.endpoint", connect[0]
    return "bus.listen", listen[0]
