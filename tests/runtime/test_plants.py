"""Plants that are no simulated world of the whole team: another kind, and one for each robot."""

from __future__ import annotations

import os
import signal
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from quadriga.shared.errors import ProcessError
from quadriga.shared.messages import Command, Event, Measurement, Reference, State, Truth
from quadriga.shared.topics import CLOCK
from quadriga.team.launch import QUADRIGA, Launch, ProcessSpec
from tests.listening import WAIT
from tests.plugins.kinds import install_package
from tests.runtime.conftest import BEGUN, FOREVER, Make, Watcher, await_tick
from tests.runtime.test_walk import await_walking, processes_of

EACH = {"team__plant_per_robot": True, "world__mode": "realtime", "team__yokes": "none"}

pytestmark = pytest.mark.usefixtures("_compiled")


def never() -> bool:
    return False


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Of processes that find the package `tests/plugins/puppet`."""
    return install_package("puppet", tmp_path_factory.mktemp("site"))


@pytest.fixture
def puppets(path: str, make_team: Make, monkeypatch: pytest.MonkeyPatch) -> Make:
    """A function that makes a team whose robots are puppets."""
    monkeypatch.setenv("PYTHONPATH", path)
    return lambda **keys: make_team(team__plant="puppet", **keys)


@pytest.mark.parametrize(
    "keys",
    [{}, {"plant__link": "bus"}, EACH],
    ids=["lockstep", "over the bus", "a plant each, in real time"],
)
def test_a_plant_of_another_package_walks(puppets: Make, keys: dict[str, Any]) -> None:
    """Both robots are measured and commanded; the walk ends when 1 s of its clock is over."""
    recording = puppets(recorder__enabled=True, world__duration=1.0, **keys).run(standing=False)
    for robot in ("r1", "r2"):
        states = [message.tick for message in recording.messages(State, robot)]
        commands = [message.tick for message in recording.messages(Command, robot)]
        if keys != EACH:
            assert states == commands == list(range(1000))
        else:  # a world that gets too little of a busy machine slows down, and states are lost
            assert min(len(states), len(commands)) > 100
    assert {m.tick for m in recording.messages(Reference)} >= set(range(0, 1000, 100))
    events = list(recording.messages(Event))
    assert [(e.tick, e.code) for e in events if e.kind == "stop"] == [(1000, "time-over")]
    assert not list(recording.messages(Truth)), "nobody knows it"
    assert not list(recording.entries({CLOCK.name}))


@pytest.mark.nightly
def test_robots_in_worlds_of_their_own_walk(make_team: Make) -> None:
    team = make_team(recorder__enabled=True, world__duration=2.0, **EACH)
    recording = team.run(standing=False)
    for robot in ("r1", "r2"):
        assert max(m.y[1] for m in recording.messages(Measurement, robot)) > 0.3, "it walks"


@pytest.mark.nightly
def test_a_fall_in_one_world_ends_the_walk_of_all(make_team: Make) -> None:
    push = "r2:2000:0:0.1:0.2"
    team = make_team(recorder__enabled=True, world__duration=9.0, world__push=push, **EACH)
    events = list(team.run().messages(Event))
    fall = next(e for e in events if e.kind == "fall")
    stop = next(e for e in events if e.kind == "stop")
    assert (fall.robot, stop.code, stop.tick) == ("r2", "fallen", fall.tick + 1000)
    assert stop.detail.startswith("fall of r2;")
    assert [e.kind for e in events].count("start") == 1


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("dies", "other", "number"),
    [(2, 1, signal.SIGTERM), (2, 1, signal.SIGKILL), (1, 2, signal.SIGKILL)],
)
def test_a_plant_that_dies_stops_the_team_and_is_named(
    puppets: Make, watcher: Watcher, dies: int, other: int, number: signal.Signals
) -> None:
    """Also if it is the one that drives time."""
    team = puppets(world__duration=FOREVER, **EACH)
    with team.launch() as running:
        pids = running.pids
        await_tick(watcher(team), 100, CLOCK)
        os.kill(pids[f"plant_r{dies}"], number)
        said = f"got plant_r{dies} gone, expected the plants of all robots"
        team.await_log(f"plant_r{other}", said)
        with pytest.raises(ProcessError, match=r"process plant_r[12]"):
            running.watch(never)
    if dies == 2:
        assert "plant-gone  plant_r2 gone" in team.log("plant_r1")
    assert not [pid for pid in pids.values() if os.path.exists(f"/proc/{pid}")]


@pytest.mark.nightly
@pytest.mark.parametrize(("frozen", "other"), [(1, 2), (2, 1)])
def test_a_frozen_plant_is_missed_in_real_time_whoever_leads(
    puppets: Make, watcher: Watcher, frozen: int, other: int
) -> None:
    """Robots of the others lie down; an arm's length of silence is enough."""
    team = puppets(world__duration=FOREVER, bus__clock_timeout=2.0, **EACH)
    with team.launch() as running:
        await_tick(watcher(team), 100, CLOCK)
        pid = running.pids[f"plant_r{frozen}"]
        os.kill(pid, signal.SIGSTOP)
        said = f"got plant_r{frozen} silent for 2 s, expected the plants"
        team.await_log(f"plant_r{other}", said)
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


@pytest.mark.nightly
def test_a_walk_that_is_told_to_stop_leaves_no_plant_behind(make_team: Make) -> None:
    team = make_team(world__duration=FOREVER, **EACH)
    out = team.folder / "out"
    walk = (*QUADRIGA, "walk", "--config", team.file, "--out", str(out))
    with subprocess.Popen(walk, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as process:
        await_walking(out, "plant_r1")
        found = {*processes_of(out).values()} - {"launcher"}
        assert found == {"plant_r1", "plant_r2", "r1", "r2", "operator"}
        process.terminate()
        assert process.wait(WAIT) == 130
    assert not processes_of(out)
