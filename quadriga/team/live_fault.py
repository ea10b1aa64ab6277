"""SHELL: asks for a fault of a sensor or a motor in a team that walks in a simulated world."""

from __future__ import annotations

from typing import Final

from quadriga.shared.bus.session import POLL, Bus
from quadriga.shared.codec import decode, encode, envelope
from quadriga.shared.codes import FAULT_ASKED, FAULT_REFUSED
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError, ConfigError, MessageError
from quadriga.shared.members import LAUNCHER
from quadriga.shared.messages import Event, LiveFault
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.topics import CLOCK, EVENT, LIVE_FAULT
from quadriga.sim_server.world.faults import build_components, parse_faults, with_time

_PATIENCE: Final = 5.0  # s, for the team to be there, and for the answer


def ask_for_fault(config: Config, fault: str) -> Event:
    """Ask for a fault, `robot/component kind [seconds]`; what the world announces of it.

    Raises:
        ConfigError: the text is none, or the world refuses it.
        BusError: the bus cannot be opened, or no world is there or answers.
    """
    robots = robot_names(config.team.robots)
    parse_faults(with_time(fault, 0), robots, tuple(build_components(config.robot)))
    with Bus.open(config.bus, config.team.name, LAUNCHER) as bus:
        bus.subscribe(EVENT.key(bus.team))
        bus.subscribe(CLOCK.key(bus.team))
        put, deadline = bus.publisher(LIVE_FAULT.key(bus.team)), monotonic() + _PATIENCE
        head: tuple[int, int] | None = None
        while head is None:
            if monotonic() > deadline:
                raise _silence(bus, config, "nobody who drives time")
            first = bus.get(POLL)
            head = None if first is None else envelope(first[1])
        put(encode(LiveFault(*head, fault)))
        deadline = monotonic() + _PATIENCE
        while monotonic() < deadline:
            for packet in (bus.get(POLL), *bus.drain()):
                event = None if packet is None else _read(packet[1])
                if event is not None and event.code == FAULT_REFUSED:
                    raise ConfigError("fault", repr(fault), "one that is permitted", event.detail)
                if event is not None and event.code == FAULT_ASKED:
                    return event
        raise _silence(bus, config, "no answer")


def _read(payload: bytes) -> Event | None:
    try:
        return decode(payload, Event)
    except MessageError:
        return None


def _silence(bus: Bus, config: Config, got: str) -> BusError:
    return BusError(
        f"fault in team {bus.team!r}",
        f"{got} within {_PATIENCE:g} s",
        "a team that walks in a simulated world",
        f"another bus.endpoint than {config.bus.endpoint}, or team.name?",
    )
