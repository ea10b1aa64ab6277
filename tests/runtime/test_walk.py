"""`quadriga walk` and `quadriga.walk` as users run them: how they end, and what they leave."""

from __future__ import annotations

import json
import os
import random
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import quadriga
from quadriga.shared.messages import Command
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.places import SOURCE
from quadriga.team.launch import QUADRIGA
from quadriga.team.registry import running_teams
from tests.listening import WAIT, await_true
from tests.runtime.conftest import BEGUN

Start = Callable[..., subprocess.Popen[str]]
KEYS = {"planner.kind": "none", "runtime.priority": "ordinary", "gait.stand_ms": 200}
SCRIPT = f"""
import sys
import quadriga
print("begun")
try:
    quadriga.walk(robots=1, seconds=60, set={KEYS!r}, out=sys.argv[1])
except KeyboardInterrupt:
    print("interrupted")
"""

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


def await_nobody(out: Path) -> None:
    await_true(lambda: not processes_of(out), lambda: processes_of(out))


def await_walking(out: Path, lead: str = "sim") -> None:
    """Wait until the world has begun."""
    log = out / "logs" / f"{lead}.log"
    await_true(lambda: log.exists() and BEGUN in log.read_text(encoding="utf-8"))


@pytest.fixture
def out(tmp_path: Path) -> Path:
    return tmp_path / "run"


@pytest.fixture
def start(out: Path) -> Iterator[Start]:
    """A function that starts a walk into `out`; nothing of it outlives the test."""
    walks = []

    def start_walk(*options: str) -> subprocess.Popen[str]:
        words = ("walk", "--robots", "2", "--planner", "none", "--no-report", "--out", str(out))
        walk = subprocess.Popen(
            (*QUADRIGA, *words, "--parent", str(os.getpid()), *options),
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


@pytest.mark.parametrize(
    "number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.nightly)]
)
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
    ticks = [m.tick for m in Recording(out / "run.mcap").messages(Command, "r1")]
    assert ticks == list(range(len(ticks)))
    for log in (out / "logs").iterdir():
        assert "Traceback" not in log.read_text()


def test_kill_9_of_the_launcher_leaves_no_orphan(out: Path, start: Start) -> None:
    walk = start("--seconds", "600")
    await_walking(out)
    assert len(processes_of(out)) == 6  # the launcher and five more
    walk.kill()
    walk.communicate()
    await_nobody(out)


@pytest.mark.nightly
@pytest.mark.usefixtures("_realtime")
@pytest.mark.parametrize("number", range(20))
def test_a_walk_that_is_stopped_at_any_moment_ends_and_leaves_nobody(
    out: Path, start: Start, number: int
) -> None:
    """In both modes, by a signal after 0 to 6 s, or not at all."""
    chance = random.Random(number)
    stop = chance.choice((signal.SIGINT, signal.SIGTERM, signal.SIGKILL, None))
    mode, after = chance.choice(("lockstep", "realtime")), chance.uniform(0.0, 6.0)
    walk = start("--seconds", "1", "--mode", mode, "--set", "runtime.check_cpu=false")
    if stop is not None:
        try:
            walk.communicate(timeout=after)
        except subprocess.TimeoutExpired:
            walk.send_signal(stop)
    said = walk.communicate(timeout=WAIT)
    # 0: it was over before. The signal's own: before Python had begun.
    allowed = {0, *((-stop,) if stop else ()), *((130,) if stop != signal.SIGKILL else ())}
    assert walk.returncode in (allowed if stop else {0}), said
    await_nobody(out)


def test_a_folder_with_a_recording_is_not_overwritten(out: Path, start: Start) -> None:
    out.mkdir()
    (out / "run.mcap").write_bytes(b"precious")
    walk = start()
    _, errors = walk.communicate(timeout=WAIT)
    assert walk.returncode == 2
    assert "expected a new folder" in errors
    assert (out / "run.mcap").read_bytes() == b"precious"


def test_a_walk_from_a_script_is_that_of_the_command(
    out: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """In a thread, too, which no signal reaches."""
    runs: list[quadriga.Run] = []

    def walk() -> None:
        runs.append(quadriga.walk(robots=2, seed=5, seconds=0.6, set=KEYS, out=out))

    thread = threading.Thread(target=walk)
    thread.start()
    thread.join(2 * WAIT)
    (run,) = runs
    assert capfd.readouterr() == ("", "")
    assert (run.folder, run.complete) == (out, True)
    assert (run.config.world.seed, run.config.team.robots) == (5, 2)
    assert run["r2/command"].shape == (600, 60)
    assert run.summary["fallen"] == []
    assert (run.folder / "report.html").is_file()
    assert run.events[-1].kind == "stop"
    with pytest.raises(quadriga.ConfigError, match="a folder with a recording"):
        quadriga.walk(out=run.folder)


@pytest.mark.parametrize(
    ("words", "keys", "message"),
    [
        ([], {"set": {"world.sed": 3}}, "did you mean 'world.seed'"),
        ([], {"set": {"recorder.enabled": False}}, r"recorder\.enabled: got false, expected true"),
        ([], {"set": {"reference.trace": "/nowhere/trace.csv"}}, r"/nowhere/trace\.csv"),
        ([], {"report": "film"}, "report: got 'film', expected one of 'table'"),
        (["hard-block"], {}, "did you mean 'hard-blocks'"),
        (["flat"], {"config": quadriga.load_config()}, "'flat' beside a Config"),
    ],
)
def test_a_mistake_of_a_script_leaves_no_folder(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: list[str],
    keys: dict[str, object],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(quadriga.ConfigError, match=message):
        quadriga.walk(*words, **keys)  # type: ignore[arg-type]
    assert not list(tmp_path.iterdir())


def test_an_interrupt_ends_the_team_and_the_script_hears_of_it(tmp_path: Path, out: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(SCRIPT, encoding="utf-8")
    with subprocess.Popen(
        [sys.executable, str(script), str(out)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(SOURCE)},
        start_new_session=True,
    ) as process:
        try:
            await_walking(out)
            process.send_signal(signal.SIGINT)
            said, complained = process.communicate(timeout=WAIT)
        finally:
            process.kill()
    assert (said, complained, process.returncode) == ("begun\ninterrupted\n", "", 0)
    await_nobody(out)
