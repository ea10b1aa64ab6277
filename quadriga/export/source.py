"""A recording as an export reads it: decoded messages in order, and what was left out."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import fields
from typing import Final, NamedTuple

from quadriga.export.layout import MessageLayout, build_layout
from quadriga.shared.codec import decode
from quadriga.shared.errors import MessageError
from quadriga.shared.messages import Message
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import Array
from quadriga.shared.topics import TABLE, topic_of

WARNINGS: Final = ("fall", "fault")  # kinds of events that are shown as warnings


class ExportedMessage(NamedTuple):
    """One decoded message: where it was published, and its numbers by `layout`."""

    name: str  # the key without the team
    robot: str
    log_time_ns: int
    message: Message
    layout: MessageLayout
    numbers: Array  # (rows, len(layout.numbers))


class Source:
    """A recording to export.

    Attributes:
        config: the configuration of the run.
        layouts: by type of message.
        left_out: messages that are not exported, by key: not valid, of no known topic, or plans
            of nothing.
        last: the last tick that was recorded, ms.
        topics: names of the topics that were recorded.
    """

    def __init__(self, recording: Recording) -> None:
        """Look through the recording once, for the names that occur in maps.

        Raises:
            RecordingError: see `recorded_config`.
        """
        self.recording, self.config = recording, recorded_config(recording)
        self.left_out: Counter[str] = Counter()
        names_of: defaultdict[tuple[type[Message], str], set[str]] = defaultdict(set)
        maps = {
            topic.name: [i.name for i in fields(topic.type) if i.metadata.get("kind") is dict]
            for topic in TABLE
        }
        self.last = 0
        self.topics: set[str] = set()
        kinds = {topic.name: topic.type for topic in TABLE}
        for entry in recording.entries(set(kinds)):
            self.last = max(self.last, entry.tick)
            topic = topic_of(entry.key)[0]
            self.topics.add(topic.name)
            if maps[topic.name]:
                try:
                    message = decode(entry.payload, topic.type)
                except MessageError:
                    continue  # counted when it is its turn
                for name in maps[topic.name]:
                    names_of[topic.type, name] |= getattr(message, name).keys()
        self.layouts = {
            kind: build_layout(
                kind,
                self.config,
                {name: tuple(sorted(names_of[kind, name])) for name in maps[topic_name]},
            )
            for topic_name, kind in kinds.items()
        }

    def items(self) -> Iterator[ExportedMessage]:
        """All messages that can be exported, in the order of the recording."""
        self.left_out.clear()
        for key, _, log_time_ns, payload in self.recording.entries():
            try:
                topic, robot = topic_of(key)
                message = decode(payload, topic.type)
            except MessageError:
                self.left_out[key] += 1
                continue
            layout = self.layouts[topic.type]
            numbers = layout.numbers_of(message)
            if numbers is None or not len(numbers):
                self.left_out[key] += 1
                continue
            yield ExportedMessage(
                key.partition("/")[2], robot, log_time_ns, message, layout, numbers
            )
