"""A team that walks, and others beside it: they find it well, and leave it so."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest

from quadriga.commands.parser import main
from quadriga.shared.messages import Command
from tests.runtime.conftest import BEGUN, FOREVER, Team, build_team, run_command
from tests.runtime.test_doctor import codes, doctor


@pytest.fixture(scope="module")
def team(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Team]:
    """All of it is still there when the tests are over, and it has missed no tick."""
    folder = tmp_path_factory.mktemp("live")
    team = build_team(folder, recorder__enabled=True, world__duration=FOREVER)
    with team.launch() as running:
        team.await_log("sim", BEGUN)
        yield team
        assert running.alive == {"sim", "r1", "r2", "operator", "recorder"}
        running.watch(lambda: True)
    ticks = [m.tick for m in team.recording().messages(Command, "r1")]
    assert ticks == list(range(len(ticks)))
    faults = [line for line in team.log("sim").splitlines() if "fault" in line]
    assert all("fault-refused" in line for line in faults), faults


def test_a_second_team_does_not_disturb_the_first(team: Team, tmp_path: Path) -> None:
    file = replace(team, folder=tmp_path).file
    commands = (("sim", "--config", file), ("agent", "--robot", "r1", "--config", file))
    with ThreadPoolExecutor() as side_by_side:
        ends = side_by_side.map(lambda words: run_command(*words), commands)
    (sim_status, sim_said), (agent_status, agent_said) = ends
    assert (sim_status, agent_status) == (2, 2)
    assert "Address already in use" in sim_said
    assert "a team that walks already" in agent_said


def test_a_doctor_finds_all_well(team: Team) -> None:
    _, report = doctor("--config", team.file)
    assert set().union(*codes(report).values()) == {"ready"}


def test_faults_are_refused_where_none_are_permitted(
    team: Team, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["fault", "r1/imu", "off", "--live", "--config", team.file]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "world.live_faults = true when the walk begins" in line
