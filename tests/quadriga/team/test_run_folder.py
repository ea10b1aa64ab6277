"""A run folder is made once, and never over a user's files."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier

import pytest

from quadriga.commands.parser import main
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config, TeamConfig
from quadriga.shared.errors import ConfigError
from quadriga.shared.recording.metadata import RECORDING
from quadriga.team.run_folder import make_run_dir


def test_a_folder_with_a_recording_is_not_used_again(tmp_path: Path) -> None:
    assert make_run_dir(tmp_path / "new") == tmp_path / "new"
    assert (tmp_path / "new").stat().st_mode & 0o777 == 0o700
    assert make_run_dir(tmp_path / "new").is_dir(), "without a recording it may be used again"
    (tmp_path / "new" / RECORDING).touch()
    with pytest.raises(ConfigError, match="a folder with a recording, expected a new folder"):
        make_run_dir(tmp_path / "new")
    with pytest.raises(ConfigError, match="Not a directory"):
        make_run_dir(tmp_path / "new" / RECORDING / "below")


def test_of_walks_that_begin_at_once_in_a_folder_one_has_it(tmp_path: Path) -> None:
    """All at the same moment: the configuration there is that of the one that was not refused."""
    begin, configs = Barrier(8), [Config(team=TeamConfig(name=f"team{k}")) for k in range(8)]

    def claim(config: Config) -> Config | None:
        begin.wait()
        try:
            make_run_dir(tmp_path / "run", config)
        except ConfigError:
            return None
        return config

    with ThreadPoolExecutor(len(configs)) as pool:
        (winner,) = filter(None, pool.map(claim, configs))
    assert load(tmp_path / "run" / "config.toml") == winner


def test_a_users_configuration_is_not_written_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "config.toml").write_text("# mine\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert main(["walk", "--config", "config.toml", "--out", str(tmp_path)]) == 2
    assert "got a folder with a config.toml, expected a new folder" in capsys.readouterr().err
    assert [path.read_text(encoding="utf-8") for path in tmp_path.iterdir()] == ["# mine\n"]


def test_a_new_folder_is_named_by_date_and_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    made = make_run_dir(None)
    assert made.parent == Path("runs")
    assert [len(part) for part in made.name.split("-")] == [8, 6]
    monkeypatch.setattr("quadriga.team.run_folder.wall_ns", lambda: 10**18)
    names = [make_run_dir(None).name for _ in range(3)]  # of walks begun in the same second
    assert names == [names[0], f"{names[0]}-2", f"{names[0]}-3"]


def test_a_refused_priority_leaves_no_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("QUADRIGA_PRIORITY", "Realtime")
    assert main(["walk", "--out", str(tmp_path / "run")]) == 2
    assert "QUADRIGA_PRIORITY" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()
