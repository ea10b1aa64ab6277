"""What is fuzzed: each makes inputs, and reads one as this project would."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import fields
from io import BytesIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final, Protocol, cast

import numpy as np

from quadriga.agents.inbox.inbox import Inbox
from quadriga.agents.planning.interface import Expected
from quadriga.agents.predictor.gate_report import GateReport
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.agents.predictor.store import Provenance, read, save
from quadriga.plant.commands import CommandBox
from quadriga.recordings.check import check, format_findings
from quadriga.recordings.echo import format_entry
from quadriga.recordings.info import format_survey
from quadriga.recordings.metadata import build_metadata
from quadriga.recordings.survey import survey
from quadriga.shared.config.load import load
from quadriga.shared.config.write import to_toml
from quadriga.shared.errors import QuadrigaError
from quadriga.shared.printable import printable_line
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.mcap_chunk import ChunkEntry
from quadriga.shared.recording.mcap_file import McapFile
from quadriga.shared.recording.reader import Recording
from quadriga.shared.recording.salvage import Salvage
from quadriga.shared.recording.seal import seal
from quadriga.shared.recording.writer import PROFILE, RecordingWriter
from quadriga.shared.wire.codec import decode, encode
from quadriga.shared.wire.envelope import envelope
from quadriga.shared.wire.messages import Message
from quadriga.shared.wire.topics import TABLE
from tests.a1 import standing
from tests.fuzz.damage import damage

_EVERYTHING: Final = Expected((1 << 40, 0), 1 << 40, 1 << 40, True)
_VALUES: Final = (
    "9" * 5000,
    "[" * 3000,
    "[" * 3000 + "]" * 3000,
    "0x" + "f" * 5000,
    "1e999",
    "nan",
    "-inf",
    "true",
    '"\\u0000"',
    '"\\u001b[2J"',
    "1979-05-27T07:32:00Z",
    "{a = 1}",
    "[]",
    '""',
    "-1",
    "1e300",
    '"' + "x" * 5000 + '"',
    "[1, 'a']",
    "9223372036854775808",
    "'r1:1e999'",
    "'r1:r1:r1'",
)
_REPORT: Final = GateReport(1, {}, {}, 0.5, (0.1,), ((1.0,),), (0.3, 2.0), 0.1, 0.5, (), ())
_SMALL: Final = {"team.robots": 1, "planner.kind": "none", "planner.N": 8, "planner.T_ini": 4}


class Target(Protocol):
    """Something that reads bytes of others."""

    def make(self, random: np.random.Generator) -> bytes:
        """An input."""
        ...

    def read(self, content: bytes) -> None:
        """Read it; raises an error of the tree, or nothing."""
        ...


class Messages:
    """Every type of message, at everybody who takes it."""

    def __init__(self) -> None:
        config = load(None, {"team.robots": 2, "estimator.kind": "truth"})
        self._inbox = Inbox(config, "r1", ("r2",))
        self._box = CommandBox(config.team.name, ("r1", "r2"), config.robot)
        self._good = [(topic, encode(example(topic.type))) for topic in TABLE]
        self._topic = TABLE[0]

    def make(self, random: np.random.Generator) -> bytes:
        self._topic, good = self._good[int(random.integers(len(self._good)))]
        return damage(good, random)

    def read(self, content: bytes) -> None:
        for robot in ("r1", "r2"):
            self._inbox.take(self._topic.key("team", robot), content)
            self._box.take(self._topic.key("team", robot), content, tick=1 << 20, oldest=0)
        while self._inbox.pop_state() is not None:
            pass
        self._inbox.pop_inputs(standing(0), _EVERYTHING)
        head = envelope(content)
        key = self._topic.key("team", "r1")
        entry = ChunkEntry(key, -1 if head is None else head[0], 0, content)
        line = format_entry(entry, full=True)
        assert line == printable_line(line)
        decode(content, self._topic.type)


def example(kind: type[Message]) -> Message:
    """A message of a type, with some content."""
    plain = {bool: True, int: 5, float: 0.1, str: "walk", list: ("r1",), dict: {"r1": 1}}
    values: dict[str, Any] = {}
    for item in fields(kind):
        meta = item.metadata
        shape = [2 if isinstance(size, str) else size for size in meta.get("shape", ())]
        values[item.name] = np.full(shape, 0.5) if shape else plain[meta["kind"]]
    return kind(**values)


class Configurations:
    """Files of a configuration, and the configurations of recordings."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / "team.toml"
        self._keys: dict[str, list[str]] = {}
        for line in to_toml(load()).splitlines():
            if line.startswith("["):
                section = self._keys.setdefault(line, [])
            elif "=" in line and not line.startswith("#"):
                section.append(line)

    def make(self, random: np.random.Generator) -> bytes:
        lines = []
        for section in random.permutation(list(self._keys))[: random.integers(1, 4)]:
            lines.append(section)
            for key in random.permutation(self._keys[section])[: random.integers(1, 5)]:
                name, _, value = str(key).partition(" = ")
                if random.random() < 0.5:
                    value = _VALUES[int(random.integers(len(_VALUES)))]
                lines.append(f"{name} = {value}")
        text = "\n".join(lines).encode()
        return text if random.random() < 0.5 else damage(text, random)

    def read(self, content: bytes) -> None:
        self._path.write_bytes(content)
        with suppress(QuadrigaError):
            text = content.decode("utf-8", "replace")
            text = json.dumps({"world": {"seed": text}}) if len(text) % 2 else text
            recorded: Any = SimpleNamespace(path=self._path, metadata={"config_json": text})
            recorded_config(cast(Recording, recorded))
        to_toml(load(self._path))


class Predictors:
    """Files of predictors, as they are and packed anew after the damage."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / "predictor.npz"
        meta = PredictorMeta.of(load(None, _SMALL))
        predictor = Predictor(meta, np.zeros((1, 1, 1, 6 * meta.N, meta.width)))
        save(self._path, predictor, Provenance("abc", (1,), (900,), (100,), {}, _REPORT))
        self._good = self._path.read_bytes()
        with np.load(self._path) as archive:
            self._document, self._G = str(archive["document"]), archive["G"]

    def make(self, random: np.random.Generator) -> bytes:
        if random.random() < 0.6:
            # What tells of the arrays is at the begin and the end of the file.
            at = int(random.integers(1, 3)) * 1000
            edges = damage(self._good[:at] + self._good[-at:], random)
            return edges[:at] + self._good[at:-at] + edges[at:]
        text = damage(self._document.encode(), random).decode("utf-8", "replace")
        packed = BytesIO()
        np.savez(packed, document=np.array(text), G=self._G)
        return packed.getvalue()

    def read(self, content: bytes) -> None:
        self._path.write_bytes(content)
        read(self._path)


class Recordings:
    """Recordings, damaged, and such as somebody made with right checksums."""

    def __init__(self, folder: Path) -> None:
        self._path, config = folder / "run.mcap", load(None, _SMALL)
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
        out = McapFile(file, 1 << 20, PROFILE, "other")
        if random.random() < 0.3:
            name = str(random.choice(list(metadata)))
            metadata[name] = damage(metadata[name].encode(), random).decode("utf-8", "replace")
        out.metadata(PROFILE, seal(metadata))
        out.metadata(f"{PROFILE}.counts", {"messages": "9" * int(random.integers(1, 5000))})
        for key, payload in self._payloads:
            shown = damage(key.encode(), random).decode("utf-8", "replace")
            channel = out.channel(key if random.random() < 0.7 else shown, "msgpack", 0)
            out.message(channel, 0, int(random.integers(1 << 62)), 1, damage(payload, random))
        out._append(damage(b"\x05" + bytes(40), random))
        out.finish()
        return file.getvalue()

    def read(self, content: bytes) -> None:
        self._path.write_bytes(content)
        with suppress(QuadrigaError):
            recording = Recording(self._path)
            list(recording.entries())
            recording.require_whole()
        with suppress(QuadrigaError):
            list(Salvage(self._path).entries())
        with suppress(QuadrigaError):
            format_findings(check(self._path))
        found = survey(self._path)
        assert all(line == printable_line(line) for line in format_survey(found))
        if found.error is not None:
            raise found.error


@contextmanager
def targets(folder: Path) -> Iterator[dict[str, Target]]:
    """All of them by name; their files are in `folder`."""
    with np.errstate(all="ignore"):
        yield {
            "messages": Messages(),
            "configurations": Configurations(folder),
            "predictors": Predictors(folder),
            "recordings": Recordings(folder),
        }
