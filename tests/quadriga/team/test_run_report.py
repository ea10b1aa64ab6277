"""A run folder is filled from its recording; the exit status of a report is that of the walk."""

from __future__ import annotations

import numpy as np
import pytest
from rich.console import Console

from quadriga.commands.parser import main
from quadriga.recordings.summary import SUMMARY
from quadriga.shared import codes
from quadriga.shared.errors import ProcessError
from quadriga.shared.messages import Event, Status
from quadriga.team import run_report
from quadriga.team.run_report import report_folder
from tests.quadriga.conftest import WriteRun, run_config


def event(code: str, robot: str, detail: str) -> list[tuple[str, Event]]:
    kind = codes.EVENTS[code]
    return [("team/sim/event", Event(1000, 10**9, kind, robot, detail, code))]


def test_a_finished_walk_is_summed_up_and_drawn(write_run: WriteRun) -> None:
    folder = write_run(
        run_config(1, 2.0), extra=event(codes.TIME_OVER, "", "end of world.duration")
    )
    summary = report_folder(folder, pictures=False, console=Console(quiet=True))
    assert not summary["fell"]
    assert (folder / SUMMARY).is_file()
    assert (folder / "trajectory.png").is_file()
    assert (folder / "report.html").stat().st_size > 50_000


@pytest.mark.parametrize("slow", ["write_figures", "scene_of", "render"])
def test_the_table_is_shown_before_anything_is_drawn(
    write_run: WriteRun,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    slow: str,
) -> None:
    folder = write_run(
        run_config(1, 2.0), extra=event(codes.TIME_OVER, "", "end of world.duration")
    )
    shown = []

    def interrupt(*_: object) -> None:
        shown.append(capsys.readouterr().out)
        raise KeyboardInterrupt

    monkeypatch.setattr(run_report, slow, interrupt)
    with pytest.raises(KeyboardInterrupt):
        report_folder(folder, pictures=True, console=Console())
    assert "distance" in shown[0]


def test_a_walk_that_was_cut_short_is_a_failure_but_summed_up(write_run: WriteRun) -> None:
    folder = write_run(run_config(1, 2.0))
    with pytest.raises(ProcessError, match=r"got an end at 2\.0 s.*its link failed"):
        report_folder(folder, pictures=False, console=Console(quiet=True))
    assert (folder / SUMMARY).is_file()


def test_a_file_that_cannot_be_written_costs_one_line(
    write_run: WriteRun, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = write_run(
        run_config(1, 2.0), extra=event(codes.TIME_OVER, "", "end of world.duration")
    )
    (folder / "summary.json").mkdir()
    assert main(["report", str(folder), "--no-render"]) == 2
    errors = capsys.readouterr().err
    assert "summary.json: got Is a directory" in errors
    assert errors.count("\n") == 1


def test_the_exit_status_of_a_report_tells_of_a_fall(
    write_run: WriteRun, capsys: pytest.CaptureFixture[str]
) -> None:
    fallen = event(codes.FALL, "r1", "tilt") + event(codes.FALLEN, "", "fall of r1")
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
    end = event(codes.TIME_OVER, "", "end of world.duration")
    folder = write_run(run_config(1, 2.0), extra=[("team/r1/status", lost), *end])
    assert main(["report", str(folder), "--no-render"]) == 1
    assert "peer-lost:r2" in capsys.readouterr().out
