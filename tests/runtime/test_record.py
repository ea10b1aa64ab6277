"""A recorder beside a team of real processes: whatever becomes of it, the team walks on."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
from pathlib import Path

import pytest

from quadriga.recordings.survey import survey
from quadriga.shared.messages import Event
from quadriga.team.launch import QUADRIGA
from tests.listening import WAIT, await_true
from tests.runtime.conftest import BEGUN, FOREVER, Make, Team


def beside(team: Team, name: str, room: int = -1) -> subprocess.Popen[str]:
    """A `quadriga record` of its own, which may write no more than `room` bytes."""
    return subprocess.Popen(
        (*QUADRIGA, "record", "-o", str(team.folder / name), "--config", team.file),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (room, -1)),
    )


@pytest.mark.nightly  # where many tests run side by side a late recorder misses what may be dropped
def test_recorders_die_beside_a_team_that_walks_on(make_team: Make) -> None:
    team = make_team(team__robots=1, recorder__enabled=True, world__duration=FOREVER)
    late = team.folder / "late.mcap"
    others = []
    try:
        with team.launch() as running:
            team.await_log("sim", BEGUN)
            others = [
                beside(team, "full.mcap", 60_000),
                beside(team, "killed.mcap"),
                beside(team, "late.mcap"),
            ]
            await_size(team.folder / "killed.mcap", 50_000)
            others[1].kill()
            others[0].wait(WAIT)
            await_size(late, (late.stat().st_size if late.exists() else 0) + 100_000)
            os.kill(running.pids["sim"], signal.SIGTERM)
            running.watch(lambda: False)  # raises if any process of the team has failed
        errors = [other.communicate(timeout=WAIT)[1] for other in others]
    finally:
        for other in others:
            other.kill()
            other.wait()
    assert [other.returncode for other in others] == [2, -signal.SIGKILL, 0], errors
    assert "got File too large, expected room for the recording" in errors[0]
    assert "joined late, has" in errors[2]
    recording = team.recording()
    recording.require_whole()
    end = list(recording.messages(Event))[-1]
    assert end.kind == "stop"
    assert end.detail.startswith("signal")
    found = survey(late)
    assert found.error is None
    state = found.tracks["team/r1/state"]
    assert state.first > 0
    assert state.last == survey(team.folder / "run.mcap").tracks["team/r1/state"].last
    cut = survey(team.folder / "killed.mcap")
    assert cut.error is not None
    assert cut.tracks["team/r1/state"].last < state.last


def await_size(path: Path, size: int) -> None:
    """Wait until a file has grown to `size` bytes."""
    await_true(lambda: path.exists() and path.stat().st_size >= size)
