"""A run folder is made once and filled from its recording."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from quadriga.commands.parser import main
from quadriga.recordings.summary import RECORDING, SUMMARY
from quadriga.shared.errors import ConfigError, ProcessError
from quadriga.shared.wire.messages import Event, Status
from quadriga.team.run_folder import make_run_dir, report
from tests.quadriga.conftest import WriteRun, run_config


def event(kind: str, robot: str, detail: str) -> list[tuple[str, Event]]:
    return [("team/sim/event", Event(1000, 10**9, kind, robot, detail))]


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


def test_a_finished_walk_is_summed_up_and_drawn(write_run: WriteRun) -> None:
    folder = write_run(run_config(1, 2.0), extra=event("stop", "", "end of world.seconds"))
    summary = report(folder, pictures=False, console=Console(quiet=True))
    assert not summary["fell"]
    assert (folder / SUMMARY).is_file()
    assert (folder / "trajectory.png").is_file()
    assert (folder / "report.html").stat().st_size > 50_000


def test_a_walk_that_was_cut_short_is_a_failure_but_summed_up(write_run: WriteRun) -> None:
    folder = write_run(run_config(1, 2.0))
    with pytest.raises(ProcessError, match=r"got an end at 2\.0 s.*its link failed"):
        report(folder, pictures=False, console=Console(quiet=True))
    assert (folder / SUMMARY).is_file()


def test_a_file_that_cannot_be_written_costs_one_line(
    write_run: WriteRun, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = write_run(run_config(1, 2.0), extra=event("stop", "", "end of world.seconds"))
    (folder / "summary.json").mkdir()
    assert main(["report", str(folder), "--no-render"]) == 2
    said = capsys.readouterr().err
    assert "summary.json: got Is a directory" in said
    assert said.count("\n") == 1


def test_the_exit_status_of_a_report_tells_of_a_fall(
    write_run: WriteRun, capsys: pytest.CaptureFixture[str]
) -> None:
    fallen = event("fall", "r1", "tilt") + event("stop", "", "fall of r1")
    folder = write_run(run_config(1, 2.0), extra=fallen)
    assert main(["report", str(folder), "--no-render"]) == 1
    out = capsys.readouterr().out
    assert "r1" in out
    assert str(folder) in out.replace("\n", "")


def test_a_robot_that_stopped_on_its_own_is_a_failure_without_a_fall(
    write_run: WriteRun, capsys: pytest.CaptureFixture[str]
) -> None:
    nothing = np.zeros(0)
    lost = Status(1999, 1999 * 10**6, "stand", "peer-lost:r2", "kalman", {}, {}, nothing, nothing)
    end = event("stop", "", "end of world.seconds")
    folder = write_run(run_config(1, 2.0), extra=[("team/r1/status", lost), *end])
    assert main(["report", str(folder), "--no-render"]) == 1
    assert "peer-lost:r2" in capsys.readouterr().out
