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
    salvage = Recording(original, salvage=True)
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
    before = Counter(entries_of(original))
    for salvage in (True, False):
        with suppress(RecordingError):
            recording = Recording(path, salvage=salvage)
            assert recording.metadata in ({}, METADATA)
            assert not Counter(recording.entries()) - before


def test_a_bad_chunk_is_named_and_skipped(original: Path) -> None:
    content = bytearray(original.read_bytes())
    chunks = [found.end() for found in re.finditer(rb"\x03\0\0\0lz4", content)]
    at = chunks[1] + 100  # among the messages of the second chunk; the last ones are its index
    content[at] ^= 1
    salvage = Recording(damaged(original, bytes(content)), salvage=True)
    found = list(salvage.entries())
    assert 900 < len(found) < 1000
    assert found[-1] == entries_of(original)[-1]
    (damage,) = salvage.damages
    assert "is corrupt (its checksum is wrong)" in damage
    before = list(Recording(damaged(original, bytes(content))).entries())
    assert before == found[: len(before)]
    assert len(before) < 200, "read as a whole one, up to the damage"


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
    found = list(Recording(damaged(tmp_path / "run.mcap", bytes(content)), salvage=True).entries())
    assert [(entry.key, entry.tick) for entry in found] == [
        (key, tick) for tick in range(1, 10) for key in KEYS[:2]
    ]


def test_the_metadata_s_copy_stands_in_and_without_one_messages_are_saved(original: Path) -> None:
    content = bytearray(original.read_bytes())
    content[content.index(b"config_sha256") + 20] ^= 1
    path = damaged(original, bytes(content))
    assert Recording(path).metadata == Recording(path, salvage=True).metadata == METADATA
    cut = damaged(original, bytes(content[: len(content) // 2]))
    with pytest.raises(RecordingError, match="metadata that fail their checksum"):
        Recording(cut)
    assert Recording(cut, salvage=True).metadata == {}
    found = list(Recording(cut, salvage=True).entries())
    assert found == entries_of(original)[: len(found)]
    assert len(found) > 400


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
            Recording(path, salvage=True)
        with pytest.raises(RecordingError):
            Recording(path)
    with pytest.raises(RecordingError, match="No such file"):
        Recording(tmp_path / "no.mcap")


@pytest.mark.parametrize(
    "options",
    [{"compression": CompressionType.NONE}, {"use_chunking": False, "index_types": IndexType.NONE}],
    ids=["packed by nothing", "without chunks"],
)
def test_a_file_that_another_program_wrote_is_told(tmp_path: Path, options: dict[str, Any]) -> None:
    path = tmp_path / "run.mcap"
    with path.open("wb") as file:
        writer = Writer(file, **options)
        writer.start(PROFILE)
        writer.add_metadata(PROFILE, seal(METADATA))
        channel = writer.register_channel("team/r1/state", "msgpack", 0)
        writer.add_message(channel, 1, encode(state(1)), 1)
        writer.finish()
    recording = Recording(path)
    assert list(recording.entries()) == []
    assert "packed with ''" in recording.cut or "outside of chunks" in recording.cut
    with pytest.raises(RecordingError, match="fails its checksum"):
        recording.require_whole()


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
