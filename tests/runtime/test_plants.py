"""Plants that are no simulated world of the whole team: another kind, and one for each robot."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from quadriga.shared.bus.session import Bus
from quadriga.shared.codec import decode
from quadriga.shared.errors import ProcessError
from quadriga.shared.messages import Clock, Command, Event, Measurement, Reference, State, Truth
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.runtime.places import SOURCE
from quadriga.shared.topics import CLOCK
from quadriga.team import launch
from quadriga.team.launch import Launch, ProcessSpec
from tests.runtime.conftest import BEGUN, WAIT, Make

FOREVER = 600.0  # s of world time
Watcher = Callable[..., Bus]
EACH = {"team__plant_per_robot": True, "world__mode": "realtime", "team__yokes": "none"}

pytestmark = pytest.mark.usefixtures("_compiled")


def never() -> bool:
    return False


@pytest.fixture(scope="session")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the package of `tests/plugins/puppet`, installed."""
    folder = tmp_path_factory.mktemp("site")
    package = folder / "source"  # a copy: pip builds where the source is
    shutil.copytree(SOURCE / "tests" / "plugins" / "puppet", package)
    pip = (sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check")
    flags = ("--no-deps", "--no-build-isolation", "--no-index", "--target", str(folder))
    subprocess.run([*pip, *flags, str(package)], check=True, timeout=WAIT)
    return folder


@pytest.fixture
def puppets(site: Path, make_team: Make, monkeypatch: pytest.MonkeyPatch) -> Make:
    """A function that makes a team whose robots are puppets."""
    path = os.pathsep.join(filter(None, (str(site), os.environ.get("PYTHONPATH", ""))))
    monkeypatch.setenv("PYTHONPATH", path)
    return lambda **keys: make_team(team__plant="puppet", **keys)


def check_walked_to_the_end(recording: Recording, *, lockstep: bool) -> None:
    """Both robots were measured and commanded; the walk ended when 1 s of its clock was over."""
    for robot in ("r1", "r2"):
        states = [message.tick for message in recording.messages(State, robot)]
        commands = [message.tick for message in recording.messages(Command, robot)]
        if lockstep:
            assert states == commands == list(range(1000))
        else:  # a world that gets too little of a busy machine slows down, and states are lost
            assert len(states) > 100
            assert len(commands) > 100
    assert {m.tick for m in recording.messages(Reference)} >= set(range(0, 1000, 100))
    events = list(recording.messages(Event))
    assert [(e.tick, e.code) for e in events if e.kind == "stop"] == [(1000, "time-over")]


@pytest.mark.parametrize(
    "keys", [{}, {"world__mode": "realtime"}, EACH], ids=["lockstep", "realtime", "a plant each"]
)
def test_a_plant_of_another_package_walks(puppets: Make, keys: dict[str, Any]) -> None:
    team = puppets(recorder__enabled=True, world__duration=1.0, **keys)
    recording = team.run(standing=False)
    check_walked_to_the_end(recording, lockstep=not keys)
    assert not list(recording.messages(Truth)), "nobody knows it"
    assert not list(recording.entries({CLOCK.name}))


def test_robots_in_worlds_of_their_own_walk(make_team: Make) -> None:
    team = make_team(recorder__enabled=True, world__duration=2.0, **EACH)
    recording = team.run(standing=False)
    for robot in ("r1", "r2"):
        speed = [m.y[1] for m in recording.messages(Measurement, robot)]
        assert max(speed) > 0.3, "it walks"


def await_clock(bus: Bus, tick: int) -> None:
    """Wait until the team's clock has come to a tick."""
    deadline, now = monotonic() + WAIT, -1
    while now < tick:
        assert monotonic() < deadline
        packet = bus.get(1.0)
        if packet is not None and packet[0] == CLOCK.key(bus.team):
            now = decode(packet[1], Clock).tick


def test_a_fall_in_one_world_ends_the_walk_of_all(make_team: Make) -> None:
    push = "r2:2000:0:0.1:0.2"
    team = make_team(recorder__enabled=True, world__duration=9.0, world__push=push, **EACH)
    events = list(team.run().messages(Event))
    fall = next(e for e in events if e.kind == "fall")
    stop = next(e for e in events if e.kind == "stop")
    assert (fall.robot, stop.code, stop.tick) == ("r2", "fallen", fall.tick + 1000)
    assert stop.detail.startswith("fall of r2;")
    assert [e.kind for e in events].count("start") == 1


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_plant_that_dies_stops_the_team_and_is_named(
    puppets: Make, watcher: Watcher, number: signal.Signals
) -> None:
    team = puppets(world__duration=FOREVER, **EACH)
    with team.launch() as running:
        pids = running.pids
        await_clock(watcher(team), 100)
        os.kill(pids["plant_r2"], number)
        team.await_log("plant_r1", "plant-gone  plant_r2 gone")
        with pytest.raises(ProcessError, match=r"process plant_r[12]"):
            running.watch(never)
    assert "got plant_r2 gone, expected the plants of all robots" in team.log("plant_r1")
    assert not [pid for pid in pids.values() if os.path.exists(f"/proc/{pid}")]


def test_the_others_leave_when_who_drives_time_dies(puppets: Make, watcher: Watcher) -> None:
    team = puppets(world__duration=FOREVER, **EACH)
    with team.launch() as running:
        pids = running.pids
        await_clock(watcher(team), 100)
        os.kill(pids["plant_r1"], signal.SIGKILL)
        team.await_log("plant_r2", "got plant_r1 gone, expected the plants of all robots")
        with pytest.raises(ProcessError, match=r"process plant_r[12]"):
            running.watch(never)
    assert not [pid for pid in pids.values() if os.path.exists(f"/proc/{pid}")]


@pytest.mark.parametrize(("frozen", "other"), [(1, 2), (2, 1)])
def test_a_frozen_plant_is_missed_in_real_time_whoever_leads(
    puppets: Make, watcher: Watcher, frozen: int, other: int
) -> None:
    """Robots of the others lie down; an arm's length of silence is enough."""
    team = puppets(world__duration=FOREVER, bus__clock_timeout=2.0, **EACH)
    with team.launch() as running:
        await_clock(watcher(team), 100)
        pid = running.pids[f"plant_r{frozen}"]
        os.kill(pid, signal.SIGSTOP)
        team.await_log(
            f"plant_r{other}", f"got plant_r{frozen} silent for 2 s, expected the plants"
        )
        os.kill(pid, signal.SIGCONT)
        with pytest.raises(ProcessError, match=r"process plant_r[12]"):
            running.watch(never)


def test_a_plant_whose_system_clock_is_off_is_refused(puppets: Make) -> None:
    team = puppets(world__duration=FOREVER, **EACH)
    file = team.folder / "clock"
    file.write_text("-0.003 0", encoding="ascii")
    rows = tuple(skewed(row, file) if row.name == "plant_r2" else row for row in team.rows())
    with Launch(rows, team.folder / "logs"):
        team.await_log("plant_r2", " ms behind that of plant_r1, expected 1 ms at most")


def skewed(row: ProcessSpec, file: Path) -> ProcessSpec:
    """The same process, in slow motion, by clocks that go as the file tells."""
    words = (*row.command[:4], "quadriga.faults.skewed", str(file), *row.command[4:])
    return replace(row, command=words)


def test_a_robot_whose_agent_leaves_ends_the_walk_of_all(make_team: Make) -> None:
    team = make_team(world__duration=FOREVER, **EACH)
    with team.launch() as running:
        team.await_log("plant_r1", BEGUN)
        os.kill(running.pids["r2"], signal.SIGKILL)
        team.await_log("plant_r2", "command-lost r2 r2 gone")
        team.await_log("plant_r1", "command-lost  r2 gone")


def test_a_walk_that_is_told_to_stop_leaves_no_plant_behind(make_team: Make) -> None:
    team = make_team(world__duration=FOREVER, **EACH)
    team.rows(standing=False)
    file = str(team.folder / "config.toml")
    walk = (*launch.QUADRIGA, "walk", "--config", file, "--out", str(team.folder / "out"))
    with subprocess.Popen(walk, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as process:
        log = team.folder / "out" / "logs" / "plant_r1.log"
        deadline = monotonic() + WAIT
        while not (log.exists() and BEGUN in log.read_text(encoding="utf-8")):
            assert monotonic() < deadline
            sleep(0.05)
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
        commands = [Path(f"/proc/{pid}/cmdline").read_bytes() for pid in children]
        assert len(commands) == 5, f"two plants, two agents, the operator, but {commands}"
        process.terminate()
        assert process.wait(WAIT) == 130
    assert not [pid for pid in children if os.path.exists(f"/proc/{pid}")]
