"""What came of a walk: the table that sums up its recording, and whether the walk failed."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from rich.console import Console

from quadriga.recordings.summary import RECORDING, summarise
from quadriga.recordings.summary_table import print_summary
from quadriga.recordings.traces import read_traces
from quadriga.shared.codes import LEAD_GONE, LINK_LOST, PLANT_FAILED, PLANT_GONE, SIGNAL
from quadriga.shared.errors import ProcessError
from quadriga.shared.modes import is_commanded
from quadriga.shared.recording.reader import Recording

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
        RecordingError: there is no recording, or it is empty or foreign.
        ProcessError: the walk did not come to its end.
    """
    summary = summarise(run_dir, read_traces(Recording(run_dir / RECORDING)))
    print_summary(summary, console)
    say_folder(run_dir, console)
    check_end(summary)
    return summary


def say_folder(run_dir: Path, console: Console) -> None:
    """Show where the walk is kept."""
    console.print(f"run folder: {run_dir}", markup=False, highlight=False, soft_wrap=True)


def has_failed(summary: dict[str, Any]) -> bool:
    """Whether a robot fell or stopped though nobody said so, or the recorder lost messages."""
    reasons = summary["stop_reasons"].values()
    return bool(summary["fell"] or summary["lost"]) or not all(map(is_commanded, reasons))


def check_end(summary: dict[str, Any]) -> None:
    """Refuse a walk that did not come to its end.

    Raises:
        ProcessError: it did not; the message says why.
    """
    end = summary["end_code"]
    if end in _CAUSES:
        raise ProcessError(
            "the walk",
            f"an end at {summary['duration']:.1f} s",
            "world.duration or a fall",
            _CAUSES[end],
        )
