"""What happened in a walk: events of the world, of agents and of who injects faults, by time."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import Final

from quadriga.shared.codec import decode
from quadriga.shared.errors import MessageError
from quadriga.shared.members import LAUNCHER
from quadriga.shared.messages import Event
from quadriga.shared.recording.reader import Recording
from quadriga.shared.topics import AGENT_EVENT, EVENT, INJECTED, Topic, topic_of

_NAMES: Final = frozenset((EVENT.name, AGENT_EVENT.name, INJECTED.name))


def read_events(recording: Recording, robots: Sequence[str]) -> tuple[Event, ...]:
    """All events of a recording; what is no valid event is left out.

    Args:
        recording: what to read.
        robots: names of the team's robots, whose own events count.

    Raises:
        RecordingError: the messages are of a schema later than this version's.
    """
    by_teller: defaultdict[str, list[Event]] = defaultdict(list)
    for entry in recording.entries(_NAMES):
        try:
            event = decode(entry.payload, Event)
        except MessageError:
            continue
        by_teller[teller_of(*topic_of(entry.key))].append(event)
    return merge_events(by_teller[""], [by_teller[name] for name in tellers(robots)])


def tellers(robots: Sequence[str]) -> tuple[str, ...]:
    """Who tells of events beside the world."""
    return (*robots, LAUNCHER)


def teller_of(topic: Topic, robot: str) -> str:
    """Who sends on a key: the robot in it, the launcher what it injects; "" is the world."""
    return LAUNCHER if topic is INJECTED else robot


def merge_events(
    of_world: Sequence[Event], of_others: Sequence[Sequence[Event]]
) -> tuple[Event, ...]:
    """All events, by time if others than the world told of some, too."""
    # Only who drives time announces the end of a walk.
    told = [event for events in of_others for event in events if event.kind != "stop"]
    return tuple(sorted([*of_world, *told], key=lambda event: event.tick) if told else of_world)
