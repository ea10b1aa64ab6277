"""Recordings: as they are damaged, and as other programs might write them."""

from __future__ import annotations

from contextlib import suppress
from io import BytesIO
from pathlib import Path

import numpy as np
from mcap.writer import CompressionType, Writer

from quadriga.recordings.check import check, format_findings
from quadriga.recordings.info import format_survey
from quadriga.recordings.metadata import build_metadata
from quadriga.recordings.recover import format_recovery, recover
from quadriga.recordings.survey import survey
from quadriga.shared.codec import encode
from quadriga.shared.config.load import load
from quadriga.shared.errors import QuadrigaError
from quadriga.shared.printable import printable_line
from quadriga.shared.recording.metadata import PROFILE, seal
from quadriga.shared.recording.reader import Recording
from quadriga.shared.recording.writer import RecordingWriter
from quadriga.shared.topics import TABLE
from tests.fuzz.arrays import SMALL
from tests.fuzz.damage import damage
from tests.fuzz.target import example
from tests.shared.recording.test_reader import append_to_chunk


class Recordings:
    """Recordings, damaged, and such as somebody made with right checksums."""

    def __init__(self, folder: Path) -> None:
        self._path, config = folder / "run.mcap", load(None, SMALL)
        self._metadata = build_metadata(config, "")
        self._payloads = [(t.key("team", "r1"), encode(example(t.type))) for t in TABLE]
        good = folder / "good.mcap"
        with RecordingWriter(good, self._metadata, 16) as writer:
            for tick in range(12):
                for key, payload in self._payloads:
                    writer.write(key, payload, tick)
        self._good = good.read_bytes()

    def make(self, random: np.random.Generator) -> bytes:
        if random.random() < 0.5:
            return damage(self._good, random)
        return self._forge(random)

    def _forge(self, random: np.random.Generator) -> bytes:
        """A file that another program might write, all of whose checksums are right."""
        file, metadata = BytesIO(), dict(self._metadata)
        out = Writer(file, compression=CompressionType.LZ4, enable_data_crcs=True)
        out.start(PROFILE, "other")
        if random.random() < 0.3:
            name = str(random.choice(list(metadata)))
            metadata[name] = damage(metadata[name].encode(), random).decode("utf-8", "replace")
        out.add_metadata(PROFILE, seal(metadata))
        out.add_metadata(f"{PROFILE}.counts", {"messages": "9" * int(random.integers(1, 5000))})
        for key, payload in self._payloads:
            shown = damage(key.encode(), random).decode("utf-8", "replace")
            channel = out.register_channel(key if random.random() < 0.7 else shown, "msgpack", 0)
            out.add_message(channel, int(random.integers(1 << 62)), damage(payload, random), 1)
        append_to_chunk(out, damage(b"\x05" + bytes(40), random))
        out.finish()
        return file.getvalue()

    def read(self, content: bytes) -> None:
        self._path.write_bytes(content)
        with suppress(QuadrigaError):
            recording = Recording(self._path)
            list(recording.entries())
            recording.require_whole()
        with suppress(QuadrigaError):
            list(Recording(self._path, salvage=True).entries())
        with suppress(QuadrigaError):
            format_findings(check(self._path))
        self._recover()
        found = survey(self._path)
        assert all(line == printable_line(line) for line in format_survey(found))
        if found.error is not None:
            raise found.error

    def _recover(self) -> None:
        out = self._path.with_name("recovered.mcap")
        out.unlink(missing_ok=True)
        with suppress(QuadrigaError):
            recovered = recover(self._path, out)
            if recovered is not None:
                format_recovery(recovered)
                Recording(out).require_whole()
