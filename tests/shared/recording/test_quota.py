"""Whatever others send, a team's own traffic is stored, and what is not stored is counted."""

from __future__ import annotations

from pathlib import Path

import pytest

from quadriga.shared.codec import encode
from quadriga.shared.recording.metadata import COUNTS
from quadriga.shared.recording.quota import LARGEST, MAX_FOREIGN_KEYS, OVERSIZED, REFUSED, Quota
from quadriga.shared.recording.reader import Recording
from quadriga.shared.recording.writer import RecordingWriter
from tests.shared.recording.test_reader import METADATA, state

OWN = "team/r1/state"


def test_keys_of_others_without_end_keep_no_own_message_out(tmp_path: Path) -> None:
    """Half of them look like those of robots. They count in all files of a recording."""
    common = Quota({OWN}.__contains__)
    foreign = [f"team/x{k}/state" if k % 2 else f"team/flood/{k}" for k in range(4200)]
    found = set()
    for part in range(2):
        path = tmp_path / f"{part}.mcap"
        with RecordingWriter(path, METADATA, quota=common) as writer:
            for key in foreign[2100 * part : 2100 * (part + 1)]:
                writer.write(key, b"", 0)
            for tick in range(20):
                writer.write(OWN, encode(state(tick)), 0)
            writer.write(foreign[0], b"", 0)
            writer.write(f"team/{'x' * 60_000}", b"", 0)
        entries = list(Recording(path).entries())
        assert [entry.tick for entry in entries if entry.key == OWN] == list(range(20))
        assert foreign[0] in {entry.key for entry in entries}, "one that is known is stored in each"
        found |= {entry.key for entry in entries}
    assert len(found) == MAX_FOREIGN_KEYS + 1
    refused = Recording(path).notes[COUNTS][REFUSED]
    assert int(refused) == common.refused[REFUSED] == 4200 + 2 - MAX_FOREIGN_KEYS


@pytest.mark.parametrize("key", [OWN, "team/flood"])
def test_what_is_too_large_to_be_a_message_is_counted(tmp_path: Path, key: str) -> None:
    with RecordingWriter(tmp_path / "run.mcap", METADATA) as writer:
        writer.write(key, bytes(LARGEST), 0)
        writer.write(key, bytes(LARGEST + 1), 0)
    assert writer.messages == 1
    recording = Recording(tmp_path / "run.mcap")
    assert [len(entry.payload) for entry in recording.entries()] == [LARGEST]
    assert recording.notes[COUNTS][OVERSIZED] == "1"
