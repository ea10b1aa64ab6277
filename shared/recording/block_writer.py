"""The MCAP library's writer, with many messages at once.

The library takes 5 µs to add one, most of it for many small writes and calls: a quarter of all that
a recorder of 6,000 a second does. Chunks and summary stay the library's.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any, Final

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import MessageIndex
from mcap.writer import Writer

_HEAD: Final = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log, publish
_FIELDS: Final = 22  # bytes of it behind the length

# A message: channel, log time and publish time in ns, sequence, payload.
RecordedMessage = tuple[int, int, int, int, bytes]


class BlockWriter(Writer):  # type: ignore[misc]  # the library has no types
    """As `Writer`."""

    def add_messages(self, messages: Sequence[RecordedMessage]) -> None:
        """What as many calls of `add_message` would write, in one chunk."""
        builder: Any = self._Writer__chunk_builder
        statistics: Any = self._Writer__statistics
        indices, counts = builder.message_indices, statistics.channel_message_counts
        parts, at, pack = list[bytes](), builder.count, _HEAD.pack
        for channel, log_time, publish_time, sequence, payload in messages:
            size = _FIELDS + len(payload)
            parts.append(pack(Opcode.MESSAGE, size, channel, sequence, log_time, publish_time))
            parts.append(payload)
            index = indices.get(channel)
            if index is None:
                index = indices[channel] = _Index(channel, [])
            index.records.append((log_time, at))
            counts[channel] += 1
            at += _HEAD.size + len(payload)
        times = [log_time for _, log_time, *_ in messages]
        first, last = min(times), max(times)
        for of, count in ((builder, builder.num_messages), (statistics, statistics.message_count)):
            of.message_start_time = min(first, of.message_start_time) if count else first
            of.message_end_time = max(last, of.message_end_time)
        builder.num_messages += len(messages)
        statistics.message_count += len(messages)
        builder.record_writer.write(b"".join(parts))
        self._Writer__maybe_finalize_chunk()


class _Index(MessageIndex):  # type: ignore[misc]
    """Written at once: the library takes two calls for each number."""

    def write(self, stream: RecordBuilder) -> None:
        numbers = [number for record in self.records for number in record]
        stream.start_record(Opcode.MESSAGE_INDEX)
        stream.write2(self.channel_id)
        stream.write4(8 * len(numbers))
        stream.write(struct.pack(f"<{len(numbers)}Q", *numbers))
        stream.finish_record()
