"""What is left of a damaged recording: a part of the original, never anything else."""

from __future__ import annotations

import re
import zlib
from collections import Counter
from contextlib import suppress
from pathlib import Path
from typing import Any

import lz4.frame
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.data_stream import RecordBuilder
from mcap.records import Chunk
from mcap.writer import CompressionType, IndexType, Writer

from quadriga.recordings.recover import recover
from quadriga.shared.codec import encode
from quadriga.shared.errors import RecordingError
from quadriga.shared.messages import Reference
from quadriga.shared.recording.metadata import PROFILE, seal
from quadriga.shared.recording.reader import (
    CORRUPT,
    LARGEST_CHUNK,
    RECORD,
    ChunkEntry,
    Recording,
    content_of,
)
from quadriga.shared.recording.recover import DamagedRecording
from quadriga.shared.recording.writer import RecordingWriter
from tests.shared.recording.test_reader import METADATA, command, state

KEYS = ("team/r1/state", "team/r1/command", "team/r2/state", "team/reference")


@pytest.fixture(scope="module")
def original(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small whole recording of some twenty chunks."""
    path = tmp_path_factory.mktemp("original") / "run.mcap"
    with RecordingWriter(path, METADATA, chunk_kib=16) as writer:
        for tick in range(250):
            asked = Reference(tick, tick, 0.1 * tick, 0.0, 0.0, 0.26)
            for key, message in zip(
                KEYS, (state(tick), command(tick), state(tick), asked), strict=True
            ):
                writer.write(key, encode(message), 1_000 * tick)
    return path


def entries_of(path: Path) -> list[ChunkEntry]:
    return list(Recording(path).entries())


def damaged(original: Path, content: bytes) -> Path:
    path = original.with_name("damaged.mcap")
    path.write_bytes(content)
    return path


def test_a_whole_file_comes_back_without_damage(original: Path) -> None:
    salvage = DamagedRecording(original)
    assert list(salvage.entries()) == entries_of(original)
    assert (salvage.damages, salvage.metadata) == ([], METADATA)
    assert salvage.notes["quadriga.counts"]["messages"] == "1000"
    Recording(original).require_whole()


@settings(max_examples=80)
@given(data=st.data())
def test_whatever_happened_to_it_the_rest_is_as_it_was(original: Path, data: st.DataObject) -> None:
    whole = original.read_bytes()
    content = bytearray(whole)
    flips = data.draw(st.integers(0, 4), label="flips")
    for _ in range(flips):
        at = data.draw(st.integers(0, len(whole) - 1), label="byte")
        content[at] ^= 1 << data.draw(st.integers(0, 7), label="bit")
    if data.draw(st.booleans(), label="cut"):
        del content[data.draw(st.integers(0, len(whole)), label="length") :]
    path = damaged(original, bytes(content))
    if bytes(content) == whole:
        Recording(path).require_whole()
        return
    with pytest.raises(RecordingError):
        Recording(path).require_whole()
    try:
        salvage = DamagedRecording(path)
    except RecordingError:
        assert len(content) < 3000 or b"quadriga" not in content[:64]
        return
    assert salvage.metadata in ({}, METADATA)
    before, found = entries_of(original), list(salvage.entries())
    assert not Counter(found) - Counter(before)
    if len(content) == len(whole):
        assert len(before) - len(found) <= flips * 60  # each costs the chunk it hit, no more
    with suppress(RecordingError):
        assert not Counter(Recording(path).entries()) - Counter(before)


def test_a_bad_chunk_is_named_and_skipped(original: Path) -> None:
    content = bytearray(original.read_bytes())
    chunks = [found.end() for found in re.finditer(rb"\x03\0\0\0lz4", content)]
    at = chunks[1] + 100  # among the messages of the second chunk; the last ones are its index
    content[at] ^= 1
    salvage = DamagedRecording(damaged(original, bytes(content)))
    found = list(salvage.entries())
    assert 900 < len(found) < 1000
    assert found[-1] == entries_of(original)[-1]
    (damage,) = salvage.damages
    assert damage.what == "a chunk that fails its checksum"
    assert damage.at <= at < damage.at + damage.size


def test_the_chunk_that_declares_the_channels_is_no_need_of_the_others(tmp_path: Path) -> None:
    """After a kill, when there is no index either."""
    writer = RecordingWriter(tmp_path / "run.mcap", METADATA)
    for tick in range(10):
        for key in KEYS[:2]:
            writer.write(key, encode(state(tick)), tick)
        writer.flush()
    content = bytearray((tmp_path / "run.mcap").read_bytes())
    content[content.index(b"\x03\0\0\0lz4") + 100] ^= 1
    writer.finish()
    found = list(DamagedRecording(damaged(tmp_path / "run.mcap", bytes(content))).entries())
    assert [(entry.key, entry.tick) for entry in found] == [
        (key, tick) for tick in range(1, 10) for key in KEYS[:2]
    ]


def test_the_metadata_s_copy_stands_in(original: Path) -> None:
    content = bytearray(original.read_bytes())
    content[content.index(b"config_sha256") + 20] ^= 1
    path = damaged(original, bytes(content))
    with pytest.raises(RecordingError, match="metadata that fail their checksum"):
        Recording(path)
    assert DamagedRecording(path).metadata == METADATA


def test_what_is_no_recording_is_refused(original: Path, tmp_path: Path) -> None:
    whole = original.read_bytes()
    files = {
        "empty": b"",
        "text": b"PK\x03\x04 a zip" * 100,
        "magic": whole[:8],
        "foreign": whole.replace(b"quadriga", b"somebody").replace(b"team/", b"band_"),
    }
    for name, content in files.items():
        path = tmp_path / f"{name}.mcap"
        path.write_bytes(content)
        with pytest.raises(RecordingError):
            DamagedRecording(path)
        with pytest.raises(RecordingError):
            Recording(path)
    with pytest.raises(RecordingError, match="No such file"):
        DamagedRecording(tmp_path / "no.mcap")


VARIANTS: dict[str, dict[str, Any]] = {
    "packed by nothing": {"compression": CompressionType.NONE},
    "without checksums": {"enable_crcs": False},
    "neither": {"compression": CompressionType.NONE, "enable_crcs": False},
    "without chunks": {"use_chunking": False, "index_types": IndexType.NONE},
    "without a summary": {
        "index_types": IndexType.NONE,
        "repeat_channels": False,
        "repeat_schemas": False,
        "use_statistics": False,
        "use_summary_offsets": False,
    },
}


def write_with_library(path: Path, *, metadata: bool = True, **options: Any) -> None:
    """A file of the MCAP library, as its tools make them of a recording."""
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=20_000, **options)
        writer.start(PROFILE)
        if metadata:
            writer.add_metadata(PROFILE, seal(METADATA))
        channel = writer.register_channel("team/r1/state", "msgpack", 0)
        for tick in range(200):
            writer.add_message(channel, tick, encode(state(tick)), tick)
        writer.finish()


@pytest.mark.parametrize("metadata", [True, False], ids=["metadata", "no-metadata"])
@pytest.mark.parametrize("options", VARIANTS.values(), ids=VARIANTS)
def test_whatever_mcap_allows_is_read_and_recovered(
    tmp_path: Path, options: dict[str, Any], *, metadata: bool
) -> None:
    path = tmp_path / "run.mcap"
    write_with_library(path, metadata=metadata, **options)
    if metadata:
        assert [entry.tick for entry in entries_of(path)] == list(range(200))
        assert recover(path, None) is None  # it is whole
    found_again = DamagedRecording(path)
    assert [entry.tick for entry in found_again.entries()] == list(range(200))
    assert found_again.damages == []
    content = path.read_bytes()
    recovery = recover(damaged(path, content[: 2 * len(content) // 3]), None)
    assert recovery is not None
    assert recovery.damages
    assert 60 < recovery.messages < 134
    found = [entry.tick for entry in Recording(recovery.out).entries()] if metadata else []
    assert found == list(range(recovery.messages if metadata else 0))


def test_damage_among_messages_outside_chunks_costs_it_and_the_one_before(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    write_with_library(path, **VARIANTS["without chunks"])
    content, before = bytearray(path.read_bytes()), entries_of(path)
    at = content.index(before[100].payload)
    content[at - 31 : at + 9] = b"\xff" * 40
    salvage = DamagedRecording(damaged(path, bytes(content)))
    # Nothing but what follows tells where a message ends.
    assert list(salvage.entries()) == before[:99] + before[101:]
    assert [damage.what for damage in salvage.damages] == ["no record begins here"]


def test_no_more_is_unpacked_than_a_chunk_states() -> None:
    """A bomb: much of nothing in a few bytes."""

    def record(content: bytes, size: int) -> bytes:
        packed = lz4.frame.compress(content)
        builder = RecordBuilder()
        Chunk("lz4", packed, 0, 0, zlib.crc32(content), size).write(builder)
        return bytes(builder.end())[RECORD.size :]

    bomb = bytes(1_000_000)
    assert content_of(record(bomb, 1_000_000)) == bomb
    for size in (0, 1000, 999_999, 1_000_001, 1 << 40, (1 << 63) - 1):
        with pytest.raises(CORRUPT):
            content_of(record(bomb, size))
    with pytest.raises(CORRUPT):
        content_of(record(bytes(LARGEST_CHUNK + 1), LARGEST_CHUNK + 1))
