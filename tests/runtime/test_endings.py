"""What all depend on is killed: each process says what has vanished, and the recording knows."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from pathlib import Path

import pytest
from rich.console import Console

from quadriga.commands.parser import main
from quadriga.recordings.check import check
from quadriga.recordings.summary import summary_of
from quadriga.recordings.traces import read_traces
from quadriga.shared.bus.session import Bus
from quadriga.shared.codes import LEAD_GONE, LINK_LOST
from quadriga.shared.errors import ProcessError
from quadriga.shared.recording.metadata import END
from quadriga.shared.topics import TRUTH
from quadriga.team.launch import Launch
from quadriga.team.run_report import report_folder
from tests.runtime.awaiting import await_tick
from tests.runtime.conftest import WAIT, Make, Team
from tests.runtime.test_router import await_routing, router

pytestmark = pytest.mark.usefixtures("_compiled")

Watcher = Callable[..., Bus]


def statuses(running: Launch) -> dict[str, int]:
    """Exit status of each process, once it has ended by itself."""
    return {name: process.wait(WAIT) for name, process in running._running.items()}


def check_recording(team: Team, code: str, what: str, capsys: pytest.CaptureFixture[str]) -> None:
    """The recording is whole, says how it ended, and all that read it say so."""
    recording, path = team.recording(), str(team.folder / "run.mcap")
    recording.require_whole()
    assert recording.notes[END]["code"] == code
    failed = {finding.name for finding in check(Path(path)) if not finding.passed}
    assert "end" in failed
    assert main(["check", path]) == 1
    assert main(["info", path]) == 0
    assert capsys.readouterr().out.count(f"{what}: none any more after") == 2
    summary = summary_of(read_traces(recording))
    assert summary["end_code"] == code
    with pytest.raises(ProcessError, match="the walk: got an end at"):
        report_folder(team.folder, pictures=False, console=Console(quiet=True))


def test_kill_9_of_who_drives_time(
    make_team: Make, watcher: Watcher, capsys: pytest.CaptureFixture[str]
) -> None:
    team = make_team(recorder__enabled=True, world__duration=600.0)
    with team.launch(standing=False) as running:
        await_tick(watcher(team, TRUTH), 500)
        os.kill(running.pids["sim"], signal.SIGKILL)
        ended = statuses(running)
    assert ended == {"sim": -signal.SIGKILL, "r1": 1, "r2": 1, "operator": 1, "recorder": 1}
    for name in ("r1", "r2", "operator", "recorder"):
        last = team.log(name).splitlines()[-1]
        assert f"process sim of team 'team', seen by {name}: got none any more after" in last
    check_recording(team, LEAD_GONE, "process sim of team 'team', seen by recorder", capsys)


@pytest.mark.parametrize("mode", ["lockstep", "realtime"])
def test_kill_9_of_the_router(
    make_team: Make, watcher: Watcher, capsys: pytest.CaptureFixture[str], mode: str
) -> None:
    keys = {"bus__mode": "client", "world__mode": mode}
    team = make_team(recorder__enabled=True, world__duration=600.0, **keys)
    with router(team) as process:
        await_routing(process)
        with team.launch(standing=False) as running:
            await_tick(watcher(team, TRUTH), 500)
            process.kill()
            ended = statuses(running)
    assert ended == dict.fromkeys(("sim", "r1", "r2", "operator", "recorder"), 1)
    link = f"to the router at {team.config.bus.endpoint}: got none any more after"
    for name in ended:
        assert f"link of {name} {link}" in team.log(name).splitlines()[-1]
    what = f"link of recorder to the router at {team.config.bus.endpoint}"
    check_recording(team, LINK_LOST, what, capsys)
