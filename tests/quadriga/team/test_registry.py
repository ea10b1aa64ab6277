"""Files by which teams are found: private, gone at the end, and not believed blindly."""

from __future__ import annotations

import json
import os
import stat
import subprocess
import sys
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from quadriga.shared.config.load import load
from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.process_use import read_use
from quadriga.team.registry import (
    RunningTeam,
    choose_team,
    running_teams,
    team_registered,
    unite_teams,
)

WALK = RunningTeam("team", "tcp/127.1.2.2:7447", "/a/config.toml", "/a", "/", 10, 500)
LAB = replace(WALK, team="lab", config="/b/config.toml", folder="/b", pid=11, started=600)
CONFIG = load(None, {"team.name": "lab", "bus.endpoint": "tcp/127.3.4.2:7447"})


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of teams, which is not there yet."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path / "quadriga"


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def entry(pid: int, started: int) -> str:
    return json.dumps(asdict(RunningTeam("t", "tcp/x:1", "/c.toml", "", "/", pid, started)))


def own_start() -> int:
    use = read_use(os.getpid())
    assert use is not None
    return use.started


def test_a_team_is_found_while_it_runs(folder: Path, tmp_path: Path) -> None:
    assert running_teams() == ()
    with team_registered(CONFIG, tmp_path / "run"):
        (team,) = running_teams()
        assert (team.team, team.endpoint) == ("lab", "tcp/127.3.4.2:7447")
        assert team.config == str(tmp_path / "run" / "config.toml")
        assert team.directory == os.getcwd()
        assert mode(folder) == 0o700
    assert running_teams() == ()
    assert list(folder.iterdir()) == []


def test_a_process_started_by_hand_leaves_its_configuration(folder: Path) -> None:
    with team_registered(CONFIG):
        (team,) = running_teams()
        assert load(Path(team.config)) == CONFIG
    assert list(folder.iterdir()) == []


def test_a_team_that_fails_leaves_nothing(folder: Path) -> None:
    with pytest.raises(ZeroDivisionError), team_registered(CONFIG):
        raise ZeroDivisionError
    assert list(folder.iterdir()) == []


def test_files_of_processes_that_have_ended_are_removed(folder: Path) -> None:
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    with team_registered(CONFIG):
        for pid, started in ((ended.pid, 5), (os.getppid(), 7)):  # the second: a number used again
            (folder / f"{pid}.json").write_text(entry(pid, started))
            (folder / f"{pid}.toml").touch()
        assert [team.team for team in running_teams()] == ["lab"]
        assert {path.stem for path in folder.iterdir()} == {str(os.getpid())}


@pytest.mark.parametrize("text", ["", "[]", "{", '{"team": "t"}', entry(1, 1)[:-1] + ', "x": 1}'])
def test_what_is_no_such_file_tells_nothing(folder: Path, text: str) -> None:
    folder.mkdir(mode=0o700)
    (folder / "1.json").write_text(text)
    assert running_teams() == ()


def test_a_folder_that_others_may_write_to_is_not_believed(folder: Path, tmp_path: Path) -> None:
    folder.mkdir()
    folder.chmod(0o777)
    (folder / "1.json").write_text(entry(os.getpid(), own_start()))
    with team_registered(CONFIG):
        assert running_teams() == ()
        assert [path.name for path in folder.iterdir()] == ["1.json"]
    folder.rename(tmp_path / "other")
    (tmp_path / "other").chmod(0o700)
    folder.symlink_to(tmp_path / "other")
    assert running_teams() == ()


def test_a_walk_goes_on_where_no_file_can_be_left(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "file"))
    with team_registered(CONFIG):
        assert running_teams() == ()


def test_processes_of_one_team_are_one_team() -> None:
    by_hand = replace(WALK, folder="", config="/run/9.toml", pid=9, started=400)
    assert unite_teams([by_hand, LAB, WALK]) == (WALK, LAB)


def test_the_only_team_is_meant() -> None:
    assert choose_team([]) is None
    assert choose_team([WALK]) is WALK
    assert choose_team([WALK, LAB], "lab") is LAB
    assert choose_team([WALK, LAB], "ghost") is None


@pytest.mark.parametrize(
    ("teams", "wanted", "cause"),
    [
        ([WALK, LAB], "", "(--team team; --team lab)"),
        (
            [WALK, replace(WALK, config="/c/config.toml", pid=12)],
            "team",
            "(--config /a/config.toml; --config /c/config.toml)",
        ),
        ([replace(WALK, config=f"/{n}.toml", pid=n) for n in range(1, 9)], "", "; and 2 more)"),
    ],
)
def test_of_several_one_must_be_chosen(teams: list[RunningTeam], wanted: str, cause: str) -> None:
    with pytest.raises(ConfigError, match=r"that run on this machine, expected the choice") as got:
        choose_team(teams, wanted)
    assert str(got.value).endswith(cause)


def test_names_of_any_length_are_shown_in_part() -> None:
    teams = [replace(WALK, team="a" * 60_000), replace(WALK, team="b" * 60_000)]
    with pytest.raises(ConfigError) as error:
        choose_team(teams)
    assert len(str(error.value)) < 600
