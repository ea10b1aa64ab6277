"""What happened in a walk: events of the world and of the agents, in order of time."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import Final

from quadriga.shared.errors import MessageError
from quadriga.shared.recording.reader import Recording
from quadriga.shared.wire.codec import decode
from quadriga.shared.wire.messages import Event
from quadriga.shared.wire.topics import AGENT_EVENT, EVENT, topic_of

_NAMES: Final = frozenset((EVENT.name, AGENT_EVENT.name))


def read_events(recording: Recording, robots: Sequence[str]) -> tuple[Event, ...]:
    """All events of a recording; what is no valid event is left out.

    Args:
        recording: what to read.
        robots: names of the team's robots, whose own events count.

    Raises:
        RecordingError: the messages are of a schema later than this version's.
    """
    by_robot: defaultdict[str, list[Event]] = defaultdict(list)
    for entry in recording.entries(_NAMES):
        try:
            event = decode(entry.payload, Event)
        except MessageError:
            continue
        by_robot[topic_of(entry.key)[1]].append(event)
    return merge_events(by_robot[""], [by_robot[robot] for robot in robots])


def merge_events(
    of_world: Sequence[Event], of_agents: Sequence[Sequence[Event]]
) -> tuple[Event, ...]:
    """All events, by time if agents told of some, too."""
    # Only who drives time announces the end of a walk.
    told = [event for events in of_agents for event in events if event.kind != "stop"]
    return tuple(sorted([*of_world, *told], key=lambda event: event.tick) if told else of_world)
