"""SHELL of the operator's word to go on, to robots that stand because an input had been lost."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from quadriga.agents.healing import WORD_MS
from quadriga.agents.modes import WALK
from quadriga.shared import members
from quadriga.shared.bus.zenoh_bus import HERE, POLL, Bus
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError, MessageError
from quadriga.shared.robot.conventions import robot_names
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.wire.codec import decode, encode
from quadriga.shared.wire.envelope import envelope
from quadriga.shared.wire.messages import Resume, Status
from quadriga.shared.wire.topics import RESUME, STATUS, topics_for

_SEARCH: Final = 5.0  # s, longest search for the team
_PATIENCE: Final = 1e-3 * WORD_MS + 1.0  # s, in which robots that may go on do so


def resume_team(config: Config) -> Mapping[str, Status]:
    """Tell all robots to go on, and wait for those that may; the newest status of each.

    Raises:
        BusError: the bus cannot be opened, or some agents are not there: then nobody is told.
    """
    team, names = config.team.name, robot_names(config.team.robots)
    with Bus.open(config.bus, team, members.RESUME) as bus:
        put = bus.publisher(RESUME.key(team), urgent=True)
        for topic in topics_for(members.RESUME):
            bus.subscribe(topic.key(team))
        keys = {STATUS.key(team, name): name for name in names}
        for key in keys:
            bus.subscribe(key)
        _await_all(bus, names)
        told, statuses, deadline = False, dict[str, Status](), monotonic() + _PATIENCE
        while monotonic() < deadline and not _all_walk(statuses, names):
            packet = bus.get(POLL)
            head = None if packet is None else envelope(packet[1])
            if packet is None or head is None:
                continue
            if not told:  # now that the team's time is known
                put(encode(Resume(*head)))
                told = True
            if packet[0] in keys:
                try:
                    statuses[keys[packet[0]]] = decode(packet[1], Status)
                except MessageError:
                    continue
        return statuses


def _await_all(bus: Bus, names: tuple[str, ...]) -> None:
    deadline = monotonic() + _SEARCH
    while absent := frozenset(names) - bus.members_at(HERE):
        if monotonic() > deadline:
            raise BusError(
                f"word to go on to team {bus.team!r}",
                f"no {', '.join(sorted(absent))} on the bus after {_SEARCH:g} s",
                f"all of {', '.join(names)}",
                "another bus.endpoint, team.name or team.robots? nobody was told",
            )
        bus.get(POLL)


def _all_walk(statuses: Mapping[str, Status], names: tuple[str, ...]) -> bool:
    return all(name in statuses and statuses[name].mode == WALK for name in names)
