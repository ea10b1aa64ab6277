"""A walk over the bus is the same world when re-simulated."""

from __future__ import annotations

import os
import signal

import pytest

from quadriga.commands.parser import main
from tests.runtime.conftest import BEGUN, Make


def test_a_walk_with_a_fault_that_somebody_asked_for_comes_out_equal(
    make_team: Make, capsys: pytest.CaptureFixture[str]
) -> None:
    team = make_team(
        team__robots=1, recorder__enabled=True, world__duration=600.0, world__live_faults=True
    )
    given = ("--config", str(team.folder / "config.toml"))
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
    assert main(["resim", str(team.folder / "run.mcap")]) == 0
    assert "equal to the byte" in capsys.readouterr().out


def test_a_team_that_permits_no_faults_refuses_them(
    make_team: Make, capsys: pytest.CaptureFixture[str]
) -> None:
    team = make_team(team__robots=1, world__duration=600.0)
    with team.launch():
        team.await_log("sim", BEGUN)
        config = str(team.folder / "config.toml")
        assert main(["fault", "r1/imu", "off", "--live", "--config", config]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "world.live_faults = true when the walk begins" in line
