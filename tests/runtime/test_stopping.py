"""A team that walks is stopped, released and sent on, by name; what was recorded replays."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from quadriga.commands.parser import main
from quadriga.recordings.traces import read_traces
from quadriga.shared.bus.session import Bus
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
from tests.runtime.awaiting import await_tick
from tests.runtime.conftest import WAIT, Make

pytestmark = pytest.mark.usefixtures("_compiled")

Watcher = Callable[..., Bus]


@pytest.mark.usefixtures("_alone")
@pytest.mark.parametrize(("mode", "robots"), [("lockstep", 1), ("realtime", 2)])
def test_stopped_released_and_sent_on(
    make_team: Make, watcher: Watcher, capsys: pytest.CaptureFixture[str], mode: str, robots: int
) -> None:
    keys = {"world__mode": mode, "world__duration": 600.0, "recorder__enabled": True}
    team = make_team(team__robots=robots, **keys)
    file, names = str(team.folder / "config.toml"), robot_names(robots)

    def said(command: str, *options: str) -> str:
        assert main([command, *options, "--config", file]) == 0
        return capsys.readouterr().out

    with team.launch(standing=False) as running:
        await_tick(watcher(team, TRUTH), 1500)
        # On a busy machine not all may have said within 0.5 s that they have stopped.
        deadline = monotonic() + WAIT
        while main(["estop", "--reason", "dog", "--config", file]) != 0:
            assert monotonic() < deadline
        assert capsys.readouterr().out.startswith(f"stopped {', '.join(names)} within")
        for name in names:
            team.await_log("sim", f"lies {name}")
        walk = "".join(f"{name}: walk\n" for name in names)
        stand = "".join(f"{name}: stand stopped:lunch\n" for name in names)
        assert said("reset", "--by", "ann") == walk
        assert said("stop", "--stand", "--reason", "lunch") == stand
        assert said("resume") == walk
        assert "the walk is over" in said("stop", "--reason", "night")
        running.watch(lambda: False)
    traces = read_traces(team.recording())
    told = [event.code for event in traces.events]
    assert FALL not in told
    for code in (ESTOPPED, LIES, RESET, STANDS_UP, STANDS_AGAIN, RESUMED, STOP_ASKED, HALTS):
        assert code in told, code
    assert (told[-1], traces.events[-1].detail.partition(";")[0]) == (STOPPED, "night")
    path = str(team.folder / "run.mcap")
    team.replay()
    if mode == "lockstep":
        assert main(["replay", path, "--all"]) == 0
        assert main(["check", path]) == 0
        assert main(["resim", path]) == 0
