"""`quadriga walk` as a user runs it: its exit statuses, and what is left when it is killed."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from quadriga.shared.messages import Command
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.team.registry import running_teams
from tests.runtime.conftest import WAIT

Start = Callable[..., subprocess.Popen[str]]
QUADRIGA = (sys.executable, "-m", "quadriga")
OPTIONS = ("--robots", "2", "--planner", "none", "--no-report")

pytestmark = pytest.mark.usefixtures("_compiled")


def processes_of(out: Path) -> dict[int, str]:
    """Names of all processes that work for the run folder `out`, by process id."""
    found = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                log = Path(os.readlink(entry / "fd" / "1"))
                words = (entry / "cmdline").read_bytes().decode(errors="replace").split("\0")
            except OSError:
                continue
            if out in log.parents:
                found[int(entry.name)] = log.stem
            elif any(word.startswith(str(out)) for word in words):
                found[int(entry.name)] = "launcher"
    return found


def await_walking(out: Path) -> None:
    """Wait until the world has begun."""
    log = out / "logs" / "sim.log"
    deadline = monotonic() + 2 * WAIT
    while not (log.exists() and "start" in log.read_text()):
        assert monotonic() < deadline, "the team never began to walk"
        sleep(0.05)


@pytest.fixture
def out(tmp_path: Path) -> Path:
    return tmp_path / "run"


@pytest.fixture
def start(out: Path) -> Iterator[Start]:
    """A function that starts a walk into `out`; nothing of it outlives the test."""
    walks = []

    def start_walk(*options: str) -> subprocess.Popen[str]:
        walk = subprocess.Popen(
            [
                *QUADRIGA,
                "walk",
                *OPTIONS,
                "--parent",
                str(os.getpid()),
                "--out",
                str(out),
                *options,
            ],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        walks.append(walk)
        return walk

    yield start_walk
    for walk in walks:
        walk.kill()
        walk.communicate()
    for pid in processes_of(out):
        os.kill(pid, signal.SIGKILL)


def test_a_walk_ends_with_its_figures_and_status_0(out: Path, start: Start) -> None:
    walk = start("--seconds", "1.5")
    output, errors = walk.communicate(timeout=4 * WAIT)
    assert (walk.returncode, errors) == (0, "")
    assert output.startswith(f"run folder: {out}\n")
    assert re.search(r"^waiting for |^walking$", output, re.MULTILINE)  # not silent in a pipe
    assert "falls" in output
    summary = json.loads((out / "summary.json").read_text())
    assert (summary["fell"], summary["gaps"], summary["robots"]) == (False, 0, 2)
    assert len(list(Recording(out / "run.mcap").messages(Command, "r2"))) == 1500
    assert not processes_of(out)


def test_a_fall_is_status_1_even_without_a_recording(start: Start) -> None:
    options = ("--seconds", "9", "--push", "r1:2000:90:0.1:0.2", "--set", "recorder.enabled=false")
    walk = start(*options)
    output, _ = walk.communicate(timeout=4 * WAIT)
    assert walk.returncode == 1
    assert re.search("fall r[12]", output)  # r1, and whom it drags along


def test_a_killed_agent_is_named_and_status_1(out: Path, start: Start) -> None:
    walk = start("--seconds", "600")
    await_walking(out)
    agent = next(pid for pid, name in processes_of(out).items() if name == "r2")
    os.kill(agent, signal.SIGKILL)
    _, errors = walk.communicate(timeout=WAIT)
    assert walk.returncode == 1
    assert "process r2: got signal 9" in errors
    assert not processes_of(out)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_and_sigterm_stop_all_cleanly(
    out: Path, start: Start, number: signal.Signals
) -> None:
    walk = start("--seconds", "600")
    await_walking(out)
    assert [team.folder for team in running_teams()] == [str(out)]  # so live commands find it
    walk.send_signal(number)
    output, errors = walk.communicate(timeout=WAIT)
    assert (walk.returncode, errors) == (130, "")
    assert running_teams() == ()
    assert "interrupted; what was recorded is in" in output
    assert not processes_of(out)
    recording = Recording(out / "run.mcap")
    ticks = [m.tick for m in recording.messages(Command, "r1")]
    assert ticks == list(range(len(ticks)))
    for log in (out / "logs").iterdir():
        assert "Traceback" not in log.read_text()


def test_kill_9_of_the_launcher_leaves_no_orphan(out: Path, start: Start) -> None:
    walk = start("--seconds", "600")
    await_walking(out)
    assert len(processes_of(out)) == 6  # the launcher and five more
    walk.kill()
    walk.communicate()
    deadline = monotonic() + WAIT
    while processes_of(out) and monotonic() < deadline:
        sleep(0.05)
    assert not processes_of(out)


def test_a_folder_with_a_recording_is_not_overwritten(out: Path, start: Start) -> None:
    out.mkdir()
    (out / "run.mcap").write_bytes(b"precious")
    walk = start()
    _, errors = walk.communicate(timeout=WAIT)
    assert walk.returncode == 2
    assert "expected a new folder" in errors
    assert (out / "run.mcap").read_bytes() == b"precious"
