"""A walk over the bus, one robot frozen for a while, is the same world when re-simulated."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable

import pytest

from quadriga.commands.parser import main
from quadriga.shared.bus.zenoh_bus import Bus
from tests.runtime.conftest import Make
from tests.runtime.frozen import PATIENCE, freeze


def test_a_walk_with_a_frozen_robot_comes_out_equal(
    make_team: Make, watcher: Callable[..., Bus], capsys: pytest.CaptureFixture[str]
) -> None:
    team = make_team(
        recorder__enabled=True,
        world__seconds=600.0,
        world__command_timeout=PATIENCE,
        world__push="r1:50:90:0.3:0.1",
    )
    with team.launch() as running:
        team.await_log("sim", "start")
        freeze(running, watcher(team), "r2", tick=100, ticks=300)
        team.await_log("sim", f"fault r2 silent for {PATIENCE:g} s")
        team.await_log("sim", "fault r2 answers again")
        os.kill(running.pids["sim"], signal.SIGTERM)
        running.watch(lambda: False)
    assert main(["resim", str(team.folder / "run.mcap")]) == 0
    output = capsys.readouterr().out
    assert "equal to the byte" in output
    assert "only" not in output
