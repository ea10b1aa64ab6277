"""The report on a walk: its summary, figures, page and pictures, from its recording."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.console import Console

from quadriga.moving_scene.page_scene import scene_of
from quadriga.pictures.render import render
from quadriga.recordings.summary import RECORDING, summarise
from quadriga.recordings.summary_table import print_summary
from quadriga.recordings.traces import read_traces
from quadriga.report.about import describe_missing
from quadriga.report.figure_files import write_figures
from quadriga.report.page import PAGE, write_page
from quadriga.report.run import build_run, read_run
from quadriga.shared.printable import printable_line
from quadriga.shared.recording.reader import Recording
from quadriga.team.run_summary import check_end, say_folder


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
    say_folder(run_dir, console)
    check_end(summary)
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
