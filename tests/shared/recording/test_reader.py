"""Writing and reading recordings, whole and cut."""

from __future__ import annotations

import json
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
import zstandard
from mcap.reader import make_reader
from mcap.records import Chunk, DataEnd, Footer
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from quadriga.shared.codec import encode
from quadriga.shared.errors import RecordingError
from quadriga.shared.messages import Command, Reference, State
from quadriga.shared.recording.metadata import PROFILE, seal
from quadriga.shared.recording.reader import Recording, content_of
from quadriga.shared.recording.writer import RecordingWriter
from quadriga.shared.topics import TABLE

METADATA = {"team": "team", "config_sha256": "ab" * 32}


def state(tick: int) -> State:
    rng = np.random.default_rng(tick)
    sizes = (12, 12, 12, 4, 3, 3, 4)
    return State(tick, tick * 1_000_000, *(rng.standard_normal(size) for size in sizes))


def command(tick: int) -> Command:
    rng = np.random.default_rng(tick)
    return Command(tick, tick * 1_000_000, *(rng.standard_normal(12) for _ in range(5)))


def write(path: Path, ticks: int, chunk_kib: int = 16) -> list[tuple[str, bytes]]:
    """A recording of `ticks` states and commands; returns what was sent."""
    sent = []
    with RecordingWriter(path, METADATA, chunk_kib) as writer:
        for tick in range(ticks):
            for key, message in (
                ("team/r1/state", state(tick)),
                ("team/r1/command", command(tick)),
            ):
                sent.append((key, encode(message)))
                writer.write(*sent[-1], log_time_ns=1_000 + tick)
    return sent


def append_to_chunk(writer: Writer, content: bytes) -> None:
    """Add bytes that are no record."""
    writer._Writer__chunk_builder.record_writer.write(content)


def test_everything_comes_back_as_sent(tmp_path: Path) -> None:
    sent = write(tmp_path / "run.mcap", 200)
    recording = Recording(tmp_path / "run.mcap")
    entries = list(recording.entries())
    assert [(e.key, e.payload) for e in entries] == sent
    assert [e.tick for e in entries] == [i // 2 for i in range(400)]
    assert [e.log_time_ns for e in entries] == [1_000 + i // 2 for i in range(400)]
    assert recording.complete
    assert recording.cut == ""
    assert recording.metadata == METADATA


def test_selection_and_decoding(tmp_path: Path) -> None:
    write(tmp_path / "run.mcap", 20)
    recording = Recording(tmp_path / "run.mcap")
    assert {e.key for e in recording.entries({"command"})} == {"team/r1/command"}
    states = list(recording.messages(State, "r1"))
    assert [message.tick for message in states] == list(range(20))
    np.testing.assert_array_equal(states[7].q_joint, state(7).q_joint)
    assert list(recording.messages(State, "r2")) == []
    assert list(recording.messages(Reference)) == []


def test_other_readers_understand_it(tmp_path: Path) -> None:
    """What the MCAP library itself sees: encodings, schemas, times, sequence, index, checksums."""
    write(tmp_path / "run.mcap", 50)
    with (tmp_path / "run.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        records = list(reader.iter_messages("team/r1/state"))
        summary = reader.get_summary()
        names = {metadata.name: metadata.metadata for metadata in reader.iter_metadata()}
        stream.seek(0)
        parts = list(StreamReader(stream, emit_chunks=True, validate_crcs=True).records)
    assert any(isinstance(part, DataEnd) and part.data_section_crc for part in parts)
    assert any(isinstance(part, Footer) and part.summary_crc for part in parts)
    assert sum(isinstance(part, Chunk) for part in parts) > 1
    schema, channel, _ = records[0]
    assert schema is not None
    assert (channel.message_encoding, schema.encoding) == ("msgpack", "jsonschema")
    assert schema.name == "quadriga.State"
    shape = json.loads(schema.data)["properties"]["q_joint"]["x-shape"]
    assert shape == [12]
    assert [m.publish_time for _, _, m in records] == [t * 1_000_000 for t in range(50)]
    assert [m.sequence for _, _, m in records] == list(range(50))
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == 100
    assert {s.name for s in summary.schemas.values()} >= {
        f"quadriga.{t.type.__name__}" for t in TABLE
    }
    assert names["quadriga"].items() > METADATA.items()
    assert names["quadriga.counts"] == {"messages": "100", "oversized": "0", "refused": "0"}


def test_what_does_not_decode_is_recorded(tmp_path: Path) -> None:
    good = encode(Reference(3, 3_000_000, 0.5, 0.0, 0.0, 0.26))
    sent = [
        ("team/r1/state", b""),
        ("team/r1/state", b"\x00\xffgarbage"),
        ("team/reference", good[:12]),
        ("team/reference", good),
        ("team/some/body/else", b"anything"),
    ]
    with RecordingWriter(tmp_path / "run.mcap", METADATA) as writer:
        for key, payload in sent:
            writer.write(key, payload, 5_000)
    assert writer.messages == 5
    entries = list(Recording(tmp_path / "run.mcap").entries())
    assert [(e.key, e.payload) for e in entries] == sent
    assert [e.tick for e in entries] == [-1, -1, -1, 3, -1]


def test_a_flushed_part_survives_a_kill(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    writer = RecordingWriter(path, METADATA, chunk_kib=1024)
    for tick in range(30):
        writer.write("team/r1/state", encode(state(tick)), tick)
    writer.flush()
    for tick in range(30, 40):
        writer.write("team/r1/state", encode(state(tick)), tick)
    recording = Recording(path)  # as a kill at this moment would leave it
    assert [entry.tick for entry in recording.entries()] == list(range(30))
    assert not recording.complete
    assert "ends at byte" in recording.cut
    writer.finish()
    assert len(list(Recording(path).entries())) == 40


@pytest.mark.parametrize("share", [0.1, 0.5, 0.97])
def test_a_cut_file_is_read_up_to_the_cut(tmp_path: Path, share: float) -> None:
    sent = write(tmp_path / "run.mcap", 300)
    whole = (tmp_path / "run.mcap").read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[: int(share * len(whole))])
    recording = Recording(cut)
    entries = [(e.key, e.payload) for e in recording.entries()]
    assert entries == sent[: len(entries)]
    assert len(entries) >= int(share * len(sent)) - 100  # at most a few chunks short
    assert not recording.complete
    assert recording.metadata == METADATA


def test_errors_name_the_file(tmp_path: Path) -> None:
    path = tmp_path / "empty.mcap"
    path.write_bytes(b"")
    with pytest.raises(RecordingError, match=r"empty\.mcap: got an empty"):
        Recording(path)
    with pytest.raises(RecordingError, match="a new one"):
        RecordingWriter(path, METADATA)
    with pytest.raises(RecordingError, match="writable folder"):
        RecordingWriter(Path("/proc/no/folder/run.mcap"), METADATA)


def test_a_chunk_whose_checksum_is_right_but_which_holds_no_records_ends_the_reading(
    tmp_path: Path,
) -> None:
    """As another program, or somebody with bad intentions, might write one."""
    path = tmp_path / "run.mcap"
    with path.open("xb") as file:
        out = Writer(file, compression=CompressionType.LZ4)
        out.start(PROFILE)
        out.add_metadata(PROFILE, seal(METADATA))
        channel = out.register_channel("team/reference", "msgpack", 0)
        out.add_message(channel, 1, encode(Reference(3, 3_000_000, 0.5, 0.0, 0.0, 0.26)), 1)
        append_to_chunk(out, b"\x05\xff\xff\xff\xff")  # a message that is cut off in its head
        out.finish()
    recording = Recording(path)
    assert [entry.tick for entry in recording.entries()] == [3]
    assert "is corrupt" in recording.cut


def test_a_file_that_is_deleted_while_it_is_written_is_noticed(tmp_path: Path) -> None:
    writer = RecordingWriter(tmp_path / "run.mcap", METADATA)
    writer.flush()
    (tmp_path / "run.mcap").unlink()
    with pytest.raises(RecordingError, match=r"run\.mcap: got a file that was deleted"):
        writer.flush()
    writer.finish()


def test_a_log_time_that_no_table_can_hold_is_read_as_the_latest_that_one_can(
    tmp_path: Path,
) -> None:
    with RecordingWriter(tmp_path / "run.mcap", METADATA) as writer:
        for log_time in (1, (1 << 63) - 1, 1 << 63, (1 << 64) - 1):
            writer.write("team/estop", b"", log_time)
    times = [entry.log_time_ns for entry in Recording(tmp_path / "run.mcap").entries()]
    assert np.array(times, dtype=np.int64).tolist() == [1] + [(1 << 63) - 1] * 3


def test_a_frame_that_would_unpack_to_more_than_its_chunk_says_is_not_unpacked() -> None:
    data = zstandard.ZstdCompressor().compress(bytes(1 << 20))
    head = struct.pack("<QQQII", 0, 0, 1000, zlib.crc32(bytes(1000)), len("zstd"))
    with pytest.raises(ValueError, match="does not unpack to 1000 bytes"):
        content_of(head + b"zstd" + struct.pack("<Q", len(data)) + data)
