"""The MCAP library's writer, with many messages at once.

The library takes 5 µs to add one, most of it for many small writes and calls: a quarter of all that
a recorder of 6,000 a second does. Chunks, index and summary stay the library's.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

from mcap.opcode import Opcode
from mcap.records import MessageIndex
from mcap.writer import Writer

_HEAD: Final = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log, publish
_FIELDS: Final = 22  # bytes of it behind the length


class RecordedMessage(NamedTuple):
    """A message of a channel; times in ns."""

    channel: int
    log_time: int
    publish_time: int
    sequence: int
    payload: bytes


class BlockWriter(Writer):  # type: ignore[misc]  # the library has no types
    """As `Writer`."""

    def add_messages(self, messages: Sequence[RecordedMessage]) -> None:
        """What as many calls of `add_message` would write, in one chunk."""
        builder: Any = self._Writer__chunk_builder
        statistics: Any = self._Writer__statistics
        indices, counts = builder.message_indices, statistics.channel_message_counts
        parts, at = list[bytes](), builder.count
        for channel, log_time, publish_time, sequence, payload in messages:
            size = _FIELDS + len(payload)
            head = _HEAD.pack(Opcode.MESSAGE, size, channel, sequence, log_time, publish_time)
            parts += (head, payload)
            index = indices.get(channel)
            if index is None:
                index = indices[channel] = MessageIndex(channel_id=channel, records=[])
            index.records.append((log_time, at))
            counts[channel] += 1
            at += _HEAD.size + len(payload)
        first, last = min(m.log_time for m in messages), max(m.log_time for m in messages)
        for of, count in ((builder, builder.num_messages), (statistics, statistics.message_count)):
            of.message_start_time = min(first, of.message_start_time) if count else first
            of.message_end_time = max(last, of.message_end_time)
        builder.num_messages += len(messages)
        statistics.message_count += len(messages)
        builder.record_writer.write(b"".join(parts))
        self._Writer__maybe_finalize_chunk()
