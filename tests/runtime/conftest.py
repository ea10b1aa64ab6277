"""Teams of real processes on a real bus, started by the launcher as `quadriga walk` does."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from quadriga.replay.outcome import format_outcome
from quadriga.replay.team_replay import replay
from quadriga.shared.bus.session import Bus
from quadriga.shared.codec import decode
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import to_toml
from quadriga.shared.errors import MessageError
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.topics import TRUTH, Topic
from quadriga.team.endpoint import free_endpoint
from quadriga.team.launch import QUADRIGA, Launch, ProcessSpec, process_table
from quadriga.warm_up import warm_up
from tests.listening import WAIT, await_true
from tests.runtime.slow_motion import SlowTime

BEGUN = "0 ms: start "  # in the log of a plant that drives time: all are there, and walk
# Less than a team collects by default, which takes minutes; for all tests the same, so that they
# collect but once.
DATA = {"identification.seconds": 60.0}
REAL_TIME = "realtime"
SPEED = 0.35  # of teams in real time: a slow computer keeps up with two robots
FOREVER = 600.0  # s of world time


def in_slow_motion(row: ProcessSpec, speed: float) -> ProcessSpec:
    """The same process of the launcher's table by slow clocks; `speed` is a share, at most 1."""
    module = row.command.index("-m") + 1  # without -P: this module lies in the working directory
    words = (row.command[0], "-m", SlowTime.__module__, str(speed), *row.command[module:])
    return replace(row, command=words)


@dataclass(frozen=True)
class Team:
    """A configuration, its folder and its processes."""

    config: Config
    folder: Path

    @property
    def file(self) -> str:
        """The configuration, written."""
        path = self.folder / "config.toml"
        path.write_text(to_toml(self.config), encoding="utf-8")
        return str(path)

    def rows(self, *, standing: bool = True) -> tuple[ProcessSpec, ...]:
        """The launcher's table, with agents that merely stand if asked for.

        Real time is kept in slow motion.
        """
        file = self.file
        rows = process_table(self.config, self.folder, None, "")
        if standing:
            names = robot_names(self.config.team.robots)
            rows = tuple(_standing(row, file) if row.name in names else row for row in rows)
        if self.config.world.mode == REAL_TIME:
            return tuple(in_slow_motion(row, SPEED) for row in rows)
        return rows

    def launch(self, *, standing: bool = True) -> Launch:
        """Start the processes."""
        return Launch(self.rows(standing=standing), self.folder / "logs")

    def log(self, name: str) -> str:
        """What a process has said."""
        return (self.folder / "logs" / f"{name}.log").read_text(encoding="utf-8")

    def await_log(self, name: str, text: str) -> None:
        """Wait until a process has said something."""
        await_true(lambda: text in self.log(name), lambda: f"no {text!r}: {self.log(name)}")

    def run(self, *, standing: bool = True) -> Recording:
        """Walk to the end; the recording, if there is a recorder."""
        with self.launch(standing=standing) as running:
            running.watch(lambda: False)
        return self.recording()

    def replay(self) -> None:
        """Compute each agent again: nothing may differ, as far as the recorder has heard all."""
        for outcome in replay(self.folder / "run.mcap", (), {}, None, None, Console(quiet=True)):
            assert outcome.verdict.first is None, format_outcome(outcome)
            assert sum(outcome.verdict.equal.values()) > 1000, format_outcome(outcome)

    def recording(self) -> Recording:
        """What was recorded."""
        return Recording(self.folder / "run.mcap")


Make = Callable[..., Team]
Watcher = Callable[..., Bus]


def _standing(row: ProcessSpec, file: str) -> ProcessSpec:
    words = ("-m", "tests.runtime.standing_agent", "--config", file, "--robot", row.name)
    return replace(row, command=(sys.executable, *words))


def build_team(folder: Path, **keys: object) -> Team:
    """A team of a test's own; keyword `section__key` sets a key."""
    given = {
        "team.robots": 2,
        "planner.kind": "none",
        "bus.endpoint": free_endpoint(),
        "bus.barrier_timeout": WAIT,
        # A machine that runs other tests stalls.
        "bus.clock_timeout": 5.0,
        "world.command_damp_ms": 2000,
        "world.mode": "lockstep",
        "recorder.enabled": False,
        "runtime.check_cpu": False,  # robots that walk late will do
    }
    keys = {name.replace("__", "."): value for name, value in keys.items()}
    return Team(load(None, given | keys), folder)


@pytest.fixture
def make_team(tmp_path: Path, request: pytest.FixtureRequest) -> Make:
    """`build_team` for a folder of the test's own; at night processes have their priority."""
    if request.node.get_closest_marker("nightly"):
        request.getfixturevalue("_realtime")
    return partial(build_team, tmp_path)


@pytest.fixture(scope="session")
def _compiled() -> None:
    """Agents that walk are compiled once, before several processes would all do it."""
    warm_up(Config(), Console(stderr=True))


@pytest.fixture
def watcher() -> Iterator[Watcher]:
    """A function that puts a bus on a team's network that hears everything, or some topics.

    In real time what somebody does not take in soon enough is dropped: on a busy machine a test
    that hears everything may miss an event.
    """
    buses = []

    def join(team: Team, *topics: Topic) -> Bus:
        name = team.config.team.name
        bus = Bus.open(team.config.bus, name, "watcher")
        buses.append(bus)
        for key in [topic.key(name, "*") for topic in topics] or (f"{name}/**",):
            bus.subscribe(key)
        return bus

    yield join
    for bus in buses:
        bus.close()


def await_packet(bus: Bus, wanted: Callable[[str, bytes], object]) -> None:
    """Wait until something is heard, of what there is on the bus."""
    deadline = monotonic() + WAIT
    while (packet := bus.get(1.0)) is None or not wanted(*packet):
        assert monotonic() < deadline, "it is never heard"


def await_tick(bus: Bus, tick: int, topic: Topic = TRUTH) -> int:
    """The time of a topic, as soon as it is `tick` or later."""
    now = -1

    def is_late_enough(key: str, payload: bytes) -> bool:
        nonlocal now
        if key == topic.key(bus.team):
            with suppress(MessageError):
                now = decode(payload, topic.type).tick
        return now >= tick

    await_packet(bus, is_late_enough)
    return now


def digests(recording: Recording) -> dict[str, str]:
    """Digest of the payloads of every key, in order; `status` carries wall-clock times."""
    found: dict[str, Any] = defaultdict(hashlib.sha256)
    for entry in recording.entries():
        if not entry.key.endswith("/status"):
            found[entry.key].update(len(entry.payload).to_bytes(4) + entry.payload)
    return {key: digest.hexdigest() for key, digest in found.items()}


@contextmanager
def router(listen: str, *options: str, says: str = "routing at") -> Iterator[subprocess.Popen[str]]:
    """The process of a router, once it has said that it listens; with `says=""` at once."""
    words = ("router", "--listen", listen, *options, "--parent", str(os.getpid()))
    with subprocess.Popen((*QUADRIGA, *words), stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stderr
            assert not says or says in process.stderr.readline()
            yield process
        finally:
            process.kill()


def run_command(*words: str) -> tuple[int, str]:
    """Run a command of `quadriga` to its end: exit status and what it said on stderr."""
    done = subprocess.run(
        (*QUADRIGA, *words), capture_output=True, text=True, timeout=WAIT, check=False
    )
    return done.returncode, done.stderr
