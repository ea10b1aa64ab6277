"""A run folder is made once, and never over a user's files."""

from __future__ import annotations

from pathlib import Path

import pytest

from quadriga.commands.parser import main
from quadriga.shared.errors import ConfigError
from quadriga.shared.recording.writer import RECORDING
from quadriga.team.run_folder import make_run_dir


def test_a_folder_with_a_recording_is_not_used_again(tmp_path: Path) -> None:
    assert make_run_dir(tmp_path / "new") == tmp_path / "new"
    assert make_run_dir(tmp_path / "new").is_dir(), "without a recording it may be used again"
    (tmp_path / "new" / RECORDING).touch()
    with pytest.raises(ConfigError, match="a folder with a recording, expected a new folder"):
        make_run_dir(tmp_path / "new")
    with pytest.raises(ConfigError, match="Not a directory"):
        make_run_dir(tmp_path / "new" / RECORDING / "below")


def test_a_users_configuration_is_not_written_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "config.toml").write_text("# mine\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert main(["walk", "--config", "config.toml", "--out", str(tmp_path)]) == 2
    assert "got the folder of --config config.toml, expected another" in capsys.readouterr().err
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
