"""Teams of real processes on a real bus, started by the launcher as `quadriga walk` does."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from rich.console import Console

from benchmarks.slow_motion import in_slow_motion
from quadriga.replay.outcome import format_outcome
from quadriga.replay.team_replay import replay
from quadriga.shared.bus.session import Bus
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import to_toml
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.topics import Topic
from quadriga.team.endpoint import free_endpoint
from quadriga.team.launch import Launch, ProcessSpec, process_table
from quadriga.warm_up import warm_up

BEGUN = "0 ms: start "  # in the log of a plant that drives time: all are there, and walk
WAIT = 60.0  # s, more than anything here takes on a busy machine
# Less than a team collects by default, which takes minutes; for all tests the same, so that they
# collect but once.
DATA = {"identification.seconds": 60.0}
REAL_TIME = "realtime"
SPEED = 0.35  # of teams in real time: a slow computer keeps up with two robots


@dataclass(frozen=True)
class Team:
    """A configuration, its folder and its processes."""

    config: Config
    folder: Path

    def rows(self, *, standing: bool = True) -> tuple[ProcessSpec, ...]:
        """The launcher's table, with agents that merely stand if asked for.

        Real time is kept in slow motion.
        """
        (self.folder / "config.toml").write_text(to_toml(self.config), encoding="utf-8")
        rows = process_table(self.config, self.folder, None, "")
        rows = tuple(self._standing(row) if standing else row for row in rows)
        if self.config.world.mode == REAL_TIME:
            return tuple(in_slow_motion(row, SPEED) for row in rows)
        return rows

    def _standing(self, row: ProcessSpec) -> ProcessSpec:
        if row.name not in robot_names(self.config.team.robots):
            return row
        module = (sys.executable, "-m", "tests.runtime.standing_agent")
        file = str(self.folder / "config.toml")
        return replace(row, command=(*module, "--config", file, "--robot", row.name))

    def launch(self, *, standing: bool = True) -> Launch:
        """Start the processes."""
        return Launch(self.rows(standing=standing), self.folder / "logs")

    def log(self, name: str) -> str:
        """What a process has said."""
        return (self.folder / "logs" / f"{name}.log").read_text(encoding="utf-8")

    def await_log(self, name: str, text: str) -> None:
        """Wait until a process has said something."""
        deadline = monotonic() + WAIT
        while text not in self.log(name):
            assert monotonic() < deadline, f"{name} never said {text!r}: {self.log(name)}"
            sleep(0.02)

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


@pytest.fixture
def make_team(tmp_path: Path, request: pytest.FixtureRequest) -> Make:
    """A function that makes a team of a test's own; keyword `section__key` sets a key.

    Real time is kept by one test's team at a time, beside no other test.
    """

    def make(**keys: object) -> Team:
        given = {
            "team.robots": 2,
            "planner.kind": "none",
            "bus.endpoint": free_endpoint(),
            "bus.barrier_timeout": WAIT,
            # A machine that runs other tests stalls.
            "bus.clock_timeout": 5.0,
            "world.command_damp_ms": 2000,
            "recorder.enabled": False,
            "runtime.check_cpu": False,  # robots that walk late will do
        }
        keys = {"world.mode": "lockstep"} | {n.replace("__", "."): v for n, v in keys.items()}
        if keys["world.mode"] == REAL_TIME:
            request.getfixturevalue("_alone")
        return Team(load(None, given | keys), tmp_path)

    return make


@pytest.fixture(scope="session")
def _compiled() -> None:
    """Agents that walk are compiled once, before several processes would all do it."""
    warm_up(Config(), Console(stderr=True))


@pytest.fixture
def watcher() -> Iterator[Callable[..., Bus]]:
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


def run_alone(row: ProcessSpec) -> tuple[int, str]:
    """Run one row's command to its end: exit status and what it said on stderr."""
    done = subprocess.run(row.command, capture_output=True, text=True, timeout=WAIT, check=False)
    return done.returncode, done.stderr
