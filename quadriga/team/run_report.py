"""The report on a walk: its summary, figures, page and pictures, from its recording."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from rich.console import Console

from quadriga.agents.modes import is_commanded
from quadriga.moving_scene.page_scene import scene_of
from quadriga.pictures.render import render
from quadriga.recordings.summary import RECORDING, summarise
from quadriga.recordings.summary_table import print_summary
from quadriga.recordings.traces import read_traces
from quadriga.report.about import describe_missing
from quadriga.report.figure_files import write_figures
from quadriga.report.page import PAGE, write_page
from quadriga.report.run import build_run, read_run
from quadriga.shared.errors import ProcessError
from quadriga.shared.printable import printable_line
from quadriga.shared.recording.reader import Recording
from quadriga.shared.wire.codes import LEAD_GONE, LINK_LOST, PLANT_FAILED, PLANT_GONE, SIGNAL

# Of an end that should not be, by the code of its event; "" where none was recorded.
_CAUSES: Final = {
    "": "the sim server or its link failed",
    SIGNAL: "the sim server was told to stop",
    PLANT_GONE: "one robot's plant failed, left or fell silent",
    PLANT_FAILED: "the plant failed: its log tells why",
    LEAD_GONE: "who drives time was killed, failed or was cut off",
    LINK_LOST: "the router was killed or stopped, or the network failed",
}


def sum_up(run_dir: Path, console: Console) -> dict[str, Any]:
    """Sum up the recording in `run_dir` and show its table, without figures and page.

    Returns:
        The summary.

    Raises:
        RecordingError: as `report_folder`.
        ProcessError: as `report_folder`.
    """
    summary = summarise(run_dir, read_traces(Recording(run_dir / RECORDING)))
    print_summary(summary, console)
    _say_folder(run_dir, console)
    _check_end(summary)
    return summary


def report_folder(run_dir: Path, *, pictures: bool, console: Console) -> dict[str, Any]:
    """Sum up the recording in `run_dir`, show its table, draw its figures, write its page.

    Returns:
        The summary.

    Raises:
        RecordingError: there is no recording, it is empty or foreign, or a file cannot be written.
        ProcessError: the walk did not come to its end.
    """
    recording = Recording(run_dir / RECORDING)
    traces = read_traces(recording)
    summary = summarise(run_dir, traces)
    print_summary(summary, console)  # before what takes long
    run = build_run(recording, traces, summary)
    write_figures(run, run_dir)
    scene = ""
    try:
        if pictures:
            with console.status("rendering"):
                scene = scene_of(run)
                if run.has_truth:  # nobody else knows where the trunks were
                    render(run_dir)
    finally:  # with the clip, or without it where drawing it failed or was interrupted
        write_page(run, run_dir / PAGE, scene)
    _say_folder(run_dir, console)
    _check_end(summary)
    return summary


def report_file(
    path: Path, page: Path | None, *, pictures: bool, console: Console
) -> dict[str, Any]:
    """Write the page of a recording that may have come from elsewhere, show its table.

    Args:
        path: the recording.
        page: the file to write; by default beside the recording, with its name.
        pictures: whether it shows the robots.
        console: where to show the table.

    Returns:
        The summary.

    Raises:
        RecordingError: the recording is empty or foreign, or the page cannot be written.
    """
    run = read_run(path)
    written = write_page(run, page or path.with_suffix(".html"), scene_of(run) if pictures else "")
    print_summary(dict(run.summary), console)
    for missing in describe_missing(run):
        console.print(printable_line(missing), style="yellow", markup=False, highlight=False)
    console.print(f"page: {written}", markup=False, highlight=False)
    return dict(run.summary)


def _say_folder(run_dir: Path, console: Console) -> None:
    console.print(f"run folder: {run_dir}", markup=False, highlight=False, soft_wrap=True)


def has_failed(summary: dict[str, Any]) -> bool:
    """Whether a robot of the summary fell, or stopped before the end though nobody said so."""
    reasons = summary["stop_reasons"].values()
    return bool(summary["fell"]) or not all(map(is_commanded, reasons))


def _check_end(summary: dict[str, Any]) -> None:
    end = summary["end_code"]
    if end in _CAUSES:
        raise ProcessError(
            "the walk",
            f"an end at {summary['duration']:.1f} s",
            "world.seconds or a fall",
            _CAUSES[end],
        )
