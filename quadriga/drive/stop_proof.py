"""Whether a team that was told to stop at once has done so, by its own words. A pure function."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from quadriga.shared import codes
from quadriga.shared.messages import Event, Status
from quadriga.shared.modes import ESTOP

PLANT: Final = "plant"
_AT_REST: Final = frozenset((codes.ESTOPPED, codes.ROBOT_STOPPED))  # what plants announce


def unconfirmed(
    robots: Iterable[str],
    statuses: Mapping[str, Status],
    events: Iterable[Event],
    *,
    plant_each: bool,
) -> list[str]:
    """Who has not said that it has stopped: robots' agents by name, and plants.

    Before the walk, at tick 0, agents take nothing in yet; the word of a robot's plant is enough.

    Args:
        robots: of the team.
        statuses: the newest of each agent since the stop.
        events: of the plants since then.
        plant_each: whether each robot has a plant of its own.
    """
    names = tuple(robots)
    at_rest = {event.robot: event.tick for event in events if event.code in _AT_REST}
    walking = [name for name in names if at_rest.get(name) != 0]
    agents = [n for n in walking if n not in statuses or statuses[n].mode != ESTOP]
    plants = names if plant_each else ("",)
    return agents + [f"{PLANT} {name}".rstrip() for name in plants if name not in at_rest]
