"""A team that walks is stopped, released and sent on, by name; what was recorded replays."""

from __future__ import annotations

import os
import signal

import pytest

from quadriga.commands.parser import main
from quadriga.recordings.traces import read_traces
from quadriga.shared.codes import (
    ESTOPPED,
    FALL,
    HALTS,
    LIES,
    RESET,
    RESUMED,
    STANDS_AGAIN,
    STANDS_UP,
    STOP_ASKED,
    STOPPED,
)
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.topics import TRUTH
from tests.listening import WAIT, await_true
from tests.runtime.conftest import BEGUN, FOREVER, Make, Watcher, await_tick


@pytest.mark.usefixtures("_compiled")
@pytest.mark.parametrize(
    ("mode", "robots"), [("lockstep", 1), pytest.param("realtime", 2, marks=pytest.mark.nightly)]
)
def test_stopped_released_and_sent_on(
    make_team: Make, watcher: Watcher, capsys: pytest.CaptureFixture[str], mode: str, robots: int
) -> None:
    keys = {"world__mode": mode, "world__duration": FOREVER, "recorder__enabled": True}
    team = make_team(team__robots=robots, **keys)
    file, names = team.file, robot_names(robots)

    def said(command: str, *options: str, again: str = "") -> str:
        status, deadline = main([command, *options, "--config", file]), monotonic() + WAIT
        # In lock-step, beside other tests, a robot may need more seconds than the command waits.
        while status == 1 and again and mode == "lockstep" and monotonic() < deadline:
            capsys.readouterr()
            status = main([again, "--config", file])
        assert status == 0
        return capsys.readouterr().out

    with team.launch(standing=False) as running:
        await_tick(watcher(team, TRUTH), 1500)
        # On a busy machine not all may have said within 0.5 s that they have stopped.
        await_true(lambda: main(["estop", "--reason", "dog", "--config", file]) == 0)
        assert capsys.readouterr().out.startswith(f"stopped {', '.join(names)} within")
        for name in names:
            team.await_log("sim", f"lies {name}")
        walk = "".join(f"{name}: walk\n" for name in names)
        stand = "".join(f"{name}: stand stopped:lunch\n" for name in names)
        assert said("reset", "--by", "ann", again="resume") == walk
        assert said("stop", "--stand", "--reason", "lunch") == stand
        assert said("resume", again="resume") == walk
        assert "the walk is over" in said("stop", "--reason", "night")
        running.watch(lambda: False)
    traces = read_traces(team.recording())
    told = [event.code for event in traces.events]
    assert FALL not in told
    for code in (ESTOPPED, LIES, RESET, STANDS_UP, STANDS_AGAIN, RESUMED, STOP_ASKED, HALTS):
        assert code in told, code
    assert (told[-1], traces.events[-1].detail.partition(";")[0]) == (STOPPED, "night")
    team.replay()
    if mode == "lockstep":
        for words in (["replay", "--all"], ["info", "--check"], ["replay", "--world"]):
            assert main([words[0], str(team.folder / "run.mcap"), *words[1:]]) == 0


def test_a_walk_with_a_fault_that_somebody_asked_for_is_the_same_world_when_re_simulated(
    make_team: Make, capsys: pytest.CaptureFixture[str]
) -> None:
    keys = {"world__duration": FOREVER, "world__live_faults": True}
    team = make_team(team__robots=1, recorder__enabled=True, **keys)
    given = ("--config", team.file)
    with team.launch() as running:
        team.await_log("sim", BEGUN)
        assert main(["fault", "r1/imu", "garbage", "--live", "--for", "0.1", *given]) == 0
        team.await_log("sim", "imu sound again")
        assert main(["fault", "r2/imu", "off", "--live", *given]) == 2
        os.kill(running.pids["sim"], signal.SIGTERM)
        running.watch(lambda: False)
    out, err = capsys.readouterr()
    assert ": r1/imu garbage " in out
    assert "robot 'r2'" in err
    assert main(["replay", "--world", str(team.folder / "run.mcap")]) == 0
    assert "equal to the byte" in capsys.readouterr().out
