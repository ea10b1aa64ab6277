"""`quadriga record`: the recorder's process."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Final

from quadriga.commands import report
from quadriga.commands.command import AddCommand, Given
from quadriga.commands.fitted_predictor import fitted_sha256
from quadriga.commands.options import KEY_HELP, add_no_render, add_wait
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.printable import printable, printable_line
from quadriga.shared.recording.quota import describe_refused
from quadriga.shared.runtime.signals import stop_flag

if TYPE_CHECKING:
    from quadriga.recorder.process import RecordedFiles
    from quadriga.recorder.selection import Selection

_SMALLEST: Final = 0.1  # MB, of a file: its schemas and index alone take some of that
_NAMED: Final = 5  # keys with losses that are named at the end


def add(add_command: AddCommand) -> None:
    command = add_command("record", run, "record the traffic of a team to an MCAP file")
    option = command.add_argument
    option(
        "-o", "--output", type=Path, metavar="FILE", help="a new file (runs/<date>-<time>/run.mcap)"
    )
    option(
        "--topics",
        nargs="+",
        default=[],
        metavar="GLOB",
        help=f"record only these keys: {KEY_HELP}",
    )
    option("--exclude", nargs="+", default=[], metavar="GLOB", help="do not record these keys")
    option(
        "--max-size",
        type=float,
        default=0.0,
        metavar="MB",
        help="no file exceeds this size: run-1.mcap, … follow",
    )
    option(
        "--max-duration",
        type=float,
        default=0.0,
        metavar="S",
        help="begin a new file every so many seconds of wall time",
    )
    option(
        "--now", action="store_true", help="record who is there until interrupted; wait for no team"
    )
    option("--predictor-sha256", default="", help="stored with the recording")
    option("--report", action="store_true", help="after the walk show what came of it")
    add_no_render(command)
    add_wait(command)


def run(arguments: argparse.Namespace, config: Config, given: Given) -> int:
    """Record until the walk is over or a signal comes, then show its report if asked to.

    Returns:
        1 if messages of the team were lost, or as `quadriga report` does.

    Raises:
        ProcessError: who drives time, or the link to the router, vanished while the team walked.
    """
    from rich.console import Console

    from quadriga.recorder import process
    from quadriga.shared.recording.metadata import RECORDING

    path, selection = arguments.output, _selection(arguments)
    if path is None:
        from quadriga.team.run_folder import make_run_dir

        path = make_run_dir(None) / RECORDING
    elif path.is_dir():
        raise ConfigError(
            "--output", f"{path}, a folder", f"a new file, such as {path / RECORDING}"
        )
    elif arguments.report and path.name != RECORDING:
        raise ConfigError("--output", str(path), f"DIR/{RECORDING}", "--report fills its folder")
    sha256 = arguments.predictor_sha256 or fitted_sha256(config, arguments.wait)
    console = Console(stderr=True, markup=False, highlight=False, soft_wrap=True)

    def say(text: str) -> None:
        console.print(printable_line(text))

    with stop_flag() as stopped:
        files = process.run(
            config, path, predictor_sha256=sha256, stopped=stopped, selection=selection, say=say
        )
        if stopped() or not arguments.report:
            print(printable(_format_files(files)), flush=True)
            if files.error is not None:
                raise files.error
            # Who has started the team reads it in the recording, and still makes its report.
            return int(bool(files.lost) and not arguments.parent)
    arguments.run, arguments.html = path.parent, None
    return report.run(arguments, config, given)


def _selection(arguments: argparse.Namespace) -> Selection:
    """What to record, and in which files.

    Raises:
        ConfigError: a limit is too small, or a report is asked for of a recording in parts.
    """
    from quadriga.recorder.parts import Limits
    from quadriga.recorder.selection import Selection

    size, seconds = arguments.max_size, arguments.max_duration
    if size and not _SMALLEST <= size < math.inf:
        raise ConfigError("--max-size", f"{size:g} MB", f"at least {_SMALLEST:g}")
    if seconds and not _SMALLEST <= seconds < math.inf:
        raise ConfigError("--max-duration", f"{seconds:g} s", f"at least {_SMALLEST:g}")
    limits = Limits(round(1e6 * size), seconds)
    if arguments.report and limits != Limits():
        raise ConfigError("--report", "a recording in parts", "one in a single file")
    return Selection(tuple(arguments.topics), tuple(arguments.exclude), limits, arguments.now)


def _format_files(files: RecordedFiles) -> str:
    """Which files were written, how many messages they hold, and what is missing or left out."""
    names = str(files.paths[0])
    if len(files.paths) > 1:
        names += f" … {files.paths[-1].name} ({len(files.paths)} files)"
    lines = [f"recorded to {names}: {files.messages:,} messages, {sum(files.lost.values()):,} lost"]
    worst = sorted(files.lost.items(), key=lambda item: -item[1])[:_NAMED]
    lines += [f"  {key}: {count:,} lost" for key, count in worst]
    lines += [f"  not stored: {text}" for text in describe_refused(files.refused)]
    return "\n".join(lines)
