"""Controllers of one's own in real teams: they walk, and who fails is named."""

from __future__ import annotations

import re

import pytest
from rich.console import Console

from quadriga.recordings.check import check, format_findings
from quadriga.recordings.summary import summary_of
from quadriga.recordings.traces import read_traces
from quadriga.replay.team_replay import replay
from quadriga.shared.errors import ProcessError, RecordingError
from quadriga.shared.runtime.places import SOURCE
from tests.runtime.conftest import Make, Team

TROT = SOURCE / "deploy" / "controllers" / "trot.py"
BARE = SOURCE / "deploy" / "controllers" / "bare_stand.py"
FAULTY = SOURCE / "tests" / "runtime" / "standing_agent.py"


def assert_checked(team: Team) -> None:
    findings = check(team.folder / "run.mcap")
    assert all(finding.passed for finding in findings), "\n".join(format_findings(findings))


def test_a_function_walks_and_is_judged_and_not_recomputed(make_team: Make) -> None:
    team = make_team(
        team__robots=1,
        team__agent_command=f"python {TROT}",
        world__duration=2.0,
        gait__stand_ms=300,
        reference__ramp=0.3,
        recorder__enabled=True,
    )
    recording = team.run(standing=False)
    assert recording.metadata["controller"].startswith(f"python {TROT} ")
    assert_checked(team)
    summary = summary_of(read_traces(recording))
    assert (summary["fell"], summary["stop_reasons"], summary["end_code"]) == (
        False,
        {},
        "time-over",
    )
    assert summary["gaps"] == 0
    assert summary["mean_vx"] > 0.3, "of 0.5 m/s"
    assert summary["estimator_rmse"]["vx"] is None, "nobody has estimated it"
    with pytest.raises(RecordingError, match=r"own cannot be recomputed; the world can"):
        replay(team.folder / "run.mcap", (), {}, None, None, Console(quiet=True))


@pytest.mark.parametrize("link", ["local", "bus"])
def test_a_program_without_quadriga_is_one_of_the_team(make_team: Make, link: str) -> None:
    assert not re.search(r"^\s*(import|from) quadriga", BARE.read_text(), re.MULTILINE)
    team = make_team(
        team__robots=2,
        team__agent_command=f"python {BARE}",
        plant__link=link,
        world__duration=0.6,
        recorder__enabled=True,
    )
    recording = team.run(standing=False)
    commands = [entry.tick for entry in recording.entries(("command",))]
    assert sorted(commands) == sorted([*range(600)] * 2)
    assert_checked(team)


@pytest.mark.parametrize(
    ("ways", "said"),
    [
        ("r1=slow r2=nan", r"r2 silent for 2 s, .* refused \(command\.tau: got nan, expected"),
        pytest.param(
            "r1=slow r2=ticks",
            r"r2 silent .* \(command\.tick: got 1100, expected 100\)",
            marks=pytest.mark.nightly,
        ),
        pytest.param("r1=slow r2=silent", r"r2 silent for 2 s$", marks=pytest.mark.nightly),
    ],
)
def test_who_fails_is_named_and_the_walk_ends(make_team: Make, ways: str, said: str) -> None:
    team = make_team(
        team__robots=2,
        team__yokes="none",
        team__agent_command=f"python {FAULTY} {ways}",
        world__duration=60.0,
        world__command_timeout=2.0,
        recorder__enabled=True,
    )
    with team.launch(standing=False) as running, pytest.raises(ProcessError, match="process sim"):
        running.watch(lambda: False)
    assert re.search(rf"100 ms: command-lost  {said}", team.log("sim"), re.MULTILINE)
    stops = summary_of(read_traces(team.recording()))["stop_reasons"]
    assert {robot: reason.partition(":")[0] for robot, reason in stops.items()} == {
        "r2": "command-lost"
    }
