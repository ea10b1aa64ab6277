"""Recorded walks whose messages decode, and say what no walk ever said, at whoever reads walks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import fields, replace
from io import BytesIO
from itertools import islice
from pathlib import Path
from typing import Any, Final
from zlib import crc32

import numpy as np
from mcap.writer import CompressionType, Writer

from quadriga.agents.agent import Agent
from quadriga.agents.inbox import Inbox
from quadriga.api.run import Run
from quadriga.export.csv_files import write_csv
from quadriga.export.source import Source
from quadriga.pictures.poses import read_poses, truth_ticks
from quadriga.playback.timeline import Timeline
from quadriga.recordings.events import read_events
from quadriga.recordings.listen import entries_from_file
from quadriga.recordings.metadata import build_metadata
from quadriga.recordings.rates import Rates
from quadriga.recordings.summary import summary_of
from quadriga.recordings.summary_table import list_figures
from quadriga.recordings.traces import read_traces
from quadriga.replay.agent_log import read_agent_log
from quadriga.replay.comparison import Comparison
from quadriga.replay.recorded_inputs import RecordedInputs
from quadriga.replay.world_replay import read_asked_faults, read_computable_config
from quadriga.report import about
from quadriga.report.run import build_run
from quadriga.report.troubles import find_troubles
from quadriga.shared.codec import MAX_INTEGER, MAX_TICK, encode
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import QuadrigaError
from quadriga.shared.messages import Message
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.metadata import PROFILE, seal
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.topics import TABLE
from quadriga.view.recorded import RecordedRun
from tests.fuzz.damage import damage
from tests.fuzz.target import example

_TICKS: Final = (0, 1, 5, 10, 990, 1000, 60_000, 1 << 31, 1 << 41, MAX_TICK - 1)
_NUMBERS: Final = (0.0, -1.0, 1e-320, 1e9, 1e200, -1e308, 5e-324)
_INTEGERS: Final = (0, 1, 5, 1 << 31, (1 << 53) + 1, MAX_INTEGER - 1)
_TEXTS: Final = (
    "",
    "r1",
    "r9",
    "walk",
    "estop",
    "fall",
    "fall: r1",
    "fault",
    "stop",
    "push",
    "\x1b[2J",
    "x" * 4000,
    "solved",
    "state:r1:5",
    "plan:r2:40.1",
    "a/b",
    "\0",
    "ä\u202e",
)
_STEPS: Final = range(0, 40, 10)  # ms, of the good walk
_EACH: Final = 4  # of a run's topics, of which all are read alike, one of so many is read as arrays
_LOG_NS: Final = 1_700_000_000_000_000_000
_MOST_STEPS: Final = 20_000  # of a replay: a thousand at most after each message


class Walks:
    """Recorded walks of two robots at one reader of walks.

    Args:
        folder: for the file that is read.
        changes: keys of the walk's configuration.
        read: reads it; raises an error of the tree, or nothing.
    """

    def __init__(
        self, folder: Path, changes: Mapping[str, Any], read: Callable[[Recording], object]
    ) -> None:
        keys = {"team.robots": 2, "planner.kind": "none", "world.duration": 1.0, **changes}
        config = load(None, keys)
        self._path, self._read = folder / "walk.mcap", read
        self._metadata = build_metadata(config, "")
        self._walk = _good_walk(config)
        self._payloads = [encode(message) for _, message in self._walk]

    def make(self, random: np.random.Generator) -> bytes:
        changed = float(random.choice([0.02, 0.1, 0.5]))
        file, channels = BytesIO(), dict[str, int]()
        out = Writer(file, 1 << 16, CompressionType.LZ4, enable_data_crcs=True)
        out.start(PROFILE, "other")
        out.add_metadata(PROFILE, seal(self._metadata))
        for place, (key, message) in enumerate(self._walk):
            chance, payload, log_ns = random.random(), self._payloads[place], 0
            if chance < 0.02:
                continue
            if chance < 0.02 + changed:
                payload = _change(message, random)
                log_ns = int(random.integers(1 << 62)) if random.random() < 0.1 else 0
            elif chance < 0.03 + changed:
                payload = damage(payload, random)
            channel = channels.get(key)
            if channel is None:
                channel = channels[key] = out.register_channel(key, "msgpack", 0)
            out.add_message(channel, log_ns or _LOG_NS + place, payload, 1)
        out.finish()
        content = file.getvalue()
        return content if random.random() < 0.9 else content[: int(random.integers(len(content)))]

    def read(self, content: bytes) -> None:
        self._path.write_bytes(content)
        self._read(Recording(self._path))


def traces(folder: Path) -> Walks:
    """What summaries, reports and lists of events are made of."""
    return Walks(folder, {"estimator.kind": "truth"}, _read_traces)


def exports(folder: Path) -> Walks:
    """What exports, scripts, pages and players read."""
    return Walks(folder, {}, lambda recording: _read_exports(recording, folder))


def replays(folder: Path) -> Walks:
    """What a replay reads: of lock-step, where rules tell what an agent took in."""
    return Walks(folder, {}, _read_replay)


def realtime_replays(folder: Path) -> Walks:
    """What a replay reads of a walk in real time, where the agents' own records tell."""
    return Walks(folder, {"world.mode": "realtime"}, _read_replay)


def _read_traces(recording: Recording) -> None:
    config = recorded_config(recording)
    read_events(recording, robot_names(config.team.robots))
    found = read_traces(recording)
    summary = summary_of(found)
    list_figures(summary)
    run = build_run(recording, found, summary)
    find_troubles(run)
    about.build_title(run)
    about.judge(run)
    list(about.list_facts(run))
    about.describe_missing(run)
    about.list_traffic(run)


def _read_exports(recording: Recording, folder: Path) -> None:
    path = recording.path
    rates = Rates(recorded_config(recording))
    with suppress(QuadrigaError):
        for entry in entries_from_file(path, ["**"]):
            rates.add(entry)
    rates.format_table()
    with suppress(QuadrigaError):
        for clock in ("world", "log"):
            timeline = Timeline(recording, ["*"], [], clock)
            list(timeline.cues(timeline.first))
    with suppress(QuadrigaError):
        recorded = RecordedRun(recording)
        for tick in (recorded.first, recorded.last):
            recorded.snapshot(tick)
    with suppress(QuadrigaError):
        ticks = truth_ticks(recording)
        read_poses(recording, ticks).radius()
    run = Run(path)
    for key in list(run.topics)[_first_topic(recording) :: _EACH]:
        with suppress(QuadrigaError):
            arrays = run[key]
            assert len(arrays.shape) == 2
    with suppress(QuadrigaError):
        run.tracking("r1")
    out = folder / "csv"
    for file in out.glob("*"):
        file.unlink()
    if out.exists():
        out.rmdir()
    write_csv(Source(recording), out, lambda tick: None)


def _first_topic(recording: Recording) -> int:
    """Of the first few topics that which is read, by what the file holds."""
    return crc32(recording.path.read_bytes()) % _EACH


def _read_replay(recording: Recording) -> None:
    config = recorded_config(recording)
    agent = Agent(config, "r1", None)
    log = read_agent_log(recording, config, agent, Inbox(config, "r1", agent.peers))
    comparison = Comparison(log)
    inputs = RecordedInputs(config, agent, Inbox(config, "r1", agent.peers), log)
    assert sum(1 for _ in islice(inputs.steps(), _MOST_STEPS)) < _MOST_STEPS
    comparison.recorded_messages(5)
    comparison.finish()
    read_asked_faults(recording)
    with suppress(QuadrigaError):
        read_computable_config(recording)


def _good_walk(config: Config) -> list[tuple[str, Message]]:
    """By key the messages of a walk that is short and tells little."""
    names = robot_names(config.team.robots)
    sizes = {"n": len(names), "k": len(names) - 1, "N": 2}
    walk = []
    for tick in _STEPS:
        for topic in TABLE:
            for robot in names if topic.key("t", "r1") != topic.key("t", "r2") else names[:1]:
                message = _fit(example(topic.type, tick), sizes, names)
                walk.append((topic.key(config.team.name, robot), message))
    return walk


def _fit(message: Message, sizes: Mapping[str, int], names: tuple[str, ...]) -> Message:
    """The message as one of a team of these sizes."""
    values: dict[str, Any] = {}
    for item in fields(message):
        shape = [
            sizes.get(d, 3) if isinstance(d, str) else d for d in item.metadata.get("shape", ())
        ]
        if shape:
            values[item.name] = np.full(shape, 0.1)
        elif item.name == "robots":
            values[item.name] = names
    return replace(message, **values)


def _change(message: Message, random: np.random.Generator) -> bytes:
    """Bytes of a message that decode, one or two of whose fields are out of the ordinary."""
    items = fields(message)
    values: dict[str, Any] = {}
    for place in random.integers(len(items), size=1 + int(random.integers(2))):
        item = items[int(place)]
        values[item.name] = _other(item.name, item.metadata, getattr(message, item.name), random)
    return encode(replace(message, **values))


def _other(name: str, about: Mapping[str, Any], value: Any, random: np.random.Generator) -> Any:
    """Another value of a field that the codec lets through."""

    def one_of(known: tuple[Any, ...]) -> Any:
        return known[int(random.integers(len(known)))]

    if name == "tick":
        return one_of(_TICKS)
    if about.get("shape"):
        array = np.array(value)
        if isinstance(about["shape"][0], str) and random.random() < 0.3:
            array = np.zeros((int(random.integers(4)), *array.shape[1:]))
        chosen = random.random(array.shape) < random.random()
        return np.where(chosen, one_of(_NUMBERS), array)
    kind = about["kind"]
    if kind is dict:
        whole = all(isinstance(each, int) for each in value.values())
        known = _INTEGERS if whole else _NUMBERS
        return {one_of(_TEXTS): one_of(known) for _ in range(int(random.integers(4)))}
    if kind is list:
        return tuple(one_of(_TEXTS) for _ in range(int(random.integers(4))))
    by_kind: dict[type, tuple[Any, ...]] = {
        bool: (True, False),
        int: _INTEGERS,
        float: _NUMBERS,
        str: _TEXTS,
    }
    return one_of(by_kind[kind])
