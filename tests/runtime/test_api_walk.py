"""A team that a script starts: what it leaves, what it raises, and that nothing outlives it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

import quadriga
from quadriga.shared.runtime.clock import monotonic, sleep
from tests.runtime.conftest import WAIT
from tests.runtime.test_walk import await_walking, processes_of

KEYS = {"planner.kind": "none", "runtime.priority": "ordinary", "gait.stand_ms": 200}
SCRIPT = """
import sys
import quadriga
print("begun")
try:
    quadriga.walk(robots=1, seconds=float(sys.argv[2]), set={KEYS}, out=sys.argv[1])
except KeyboardInterrupt:
    print("interrupted")
"""

pytestmark = pytest.mark.usefixtures("_compiled")


def test_a_walk_from_a_script_is_that_of_the_command(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """In a thread, too, which no signal reaches."""
    runs: list[quadriga.Run] = []

    def walk() -> None:
        runs.append(quadriga.walk(robots=2, seed=5, seconds=0.6, set=KEYS, out=tmp_path / "run"))

    thread = threading.Thread(target=walk)
    thread.start()
    thread.join(2 * WAIT)
    (run,) = runs
    assert capfd.readouterr() == ("", "")
    assert (run.folder, run.complete) == (tmp_path / "run", True)
    assert (run.config.world.seed, run.config.team.robots) == (5, 2)
    assert run["r2/command"].shape == (600, 60)
    assert run.summary["fallen"] == []
    assert (run.folder / "report.html").is_file()
    assert run.events[-1].kind == "stop"
    with pytest.raises(quadriga.ConfigError, match="a folder with a recording"):
        quadriga.walk(out=run.folder)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"world.sed": 3}, "did you mean 'world.seed'"),
        ({"recorder.enabled": False}, r"recorder\.enabled: got false, expected true"),
        ({"reference.trace": "/nowhere/trace.csv"}, r"/nowhere/trace\.csv"),
    ],
)
def test_a_mistake_leaves_no_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, keys: dict[str, object], message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(quadriga.ConfigError, match=message):
        quadriga.walk(set=keys)
    with pytest.raises(quadriga.ConfigError, match="report: got 'film', expected one of 'table'"):
        quadriga.walk(report="film")
    with pytest.raises(quadriga.ConfigError, match="did you mean 'hard-blocks'"):
        quadriga.walk("hard-block")
    with pytest.raises(quadriga.ConfigError, match="'flat' beside a Config"):
        quadriga.walk("flat", config=quadriga.load_config())
    assert not list(tmp_path.iterdir())


def test_an_interrupt_ends_the_team_and_the_script_hears_of_it(tmp_path: Path) -> None:
    script, out = tmp_path / "script.py", tmp_path / "run"
    script.write_text(SCRIPT.replace("{KEYS}", repr(KEYS)), encoding="utf-8")
    with subprocess.Popen(
        [sys.executable, str(script), str(out), "60"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
        start_new_session=True,
    ) as process:
        try:
            await_walking(out)
            process.send_signal(signal.SIGINT)
            said, complained = process.communicate(timeout=WAIT)
        finally:
            process.kill()
    assert (said, complained, process.returncode) == ("begun\ninterrupted\n", "", 0)
    deadline = monotonic() + WAIT
    while processes_of(out):
        assert monotonic() < deadline, processes_of(out)
        sleep(0.05)
