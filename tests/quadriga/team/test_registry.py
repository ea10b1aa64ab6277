"""Files by which teams are found: private, gone at the end, and not believed blindly."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from quadriga.shared.config.load import load
from quadriga.shared.runtime.process_use import read_use
from quadriga.team.registry import running_teams, team_registered
from quadriga.team.running_team import RunningTeam, to_json

CONFIG = load(None, {"team.name": "lab", "bus.endpoint": "tcp/127.3.4.2:7447"})


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of teams, which is not there yet."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path / "quadriga"


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def entry(pid: int, started: int) -> str:
    return to_json(RunningTeam("t", "tcp/x:1", "/c.toml", "", "/", pid, started))


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
        assert {mode(path) for path in folder.iterdir()} == {0o600}
    assert running_teams() == ()
    assert list(folder.iterdir()) == []


def test_a_process_started_by_hand_leaves_its_configuration(folder: Path) -> None:
    with team_registered(CONFIG):
        (team,) = running_teams()
        assert load(Path(team.config)) == CONFIG
        assert mode(Path(team.config)) == 0o600
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
            (folder / f"{pid}.json").chmod(0o600)
            (folder / f"{pid}.toml").touch()
        assert [team.team for team in running_teams()] == ["lab"]
        assert {path.stem for path in folder.iterdir()} == {str(os.getpid())}


def test_what_others_may_write_is_not_believed(folder: Path, tmp_path: Path) -> None:
    folder.mkdir(mode=0o700)
    file = folder / "1.json"
    file.write_text(entry(os.getpid(), own_start()))
    file.chmod(0o600)
    assert len(running_teams()) == 1
    file.chmod(0o622)
    assert running_teams() == ()
    file.chmod(0o600)
    elsewhere = file.rename(tmp_path / "elsewhere.json")
    file.symlink_to(elsewhere)
    assert running_teams() == ()
    file.unlink()
    os.mkfifo(file, 0o600)  # nobody writes: to open it would wait for ever
    assert running_teams() == ()


def test_a_folder_that_others_may_write_to_is_not_believed(folder: Path, tmp_path: Path) -> None:
    folder.mkdir()
    folder.chmod(0o777)
    (folder / "1.json").write_text(entry(os.getpid(), own_start()))
    (folder / "1.json").chmod(0o600)
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
