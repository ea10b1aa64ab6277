"""Options of the commands that make, read and mend recordings."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

from quadriga.commands import recording_verbs as verbs

Add = Callable[[str, Any, str], argparse.ArgumentParser]
_KEYS = "a topic, a robot or a key: plan, r2, r1/state, 'r*/**'"


def add_file(command: argparse.ArgumentParser, what: str = "") -> None:
    """The recording that a command reads."""
    doc = f"a recording {what}".rstrip()
    command.add_argument("file", type=_file, metavar="FILE", help=f"{doc}, or its run folder")


def add_record_options(record: argparse.ArgumentParser) -> None:
    """Of `quadriga record`."""
    record.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="a new file (runs/<date>-<time>/run.mcap)"
    )
    record.add_argument(
        "--topics", nargs="+", default=[], metavar="GLOB", help=f"record only these keys: {_KEYS}"
    )
    record.add_argument(
        "--exclude", nargs="+", default=[], metavar="GLOB", help="do not record these keys"
    )
    record.add_argument(
        "--max-size",
        type=float,
        default=0.0,
        metavar="MB",
        help="no file exceeds this size: run-1.mcap, … follow",
    )
    record.add_argument(
        "--max-duration",
        type=float,
        default=0.0,
        metavar="S",
        help="begin a new file every so many seconds of wall time",
    )
    record.add_argument(
        "--now", action="store_true", help="record who is there until interrupted; wait for no team"
    )
    record.add_argument("--predictor-sha256", default="", help="stored with the recording")
    record.add_argument("--report", action="store_true", help="after the walk show what came of it")
    record.add_argument("--no-render", action="store_true", help="no pictures of the walk")


def add_verbs(add: Add) -> None:
    """The commands themselves."""
    info = add("info", verbs.info, "say what a recording holds")
    add_file(info)
    recover = add("recover", verbs.recover, "write what is readable of a damaged recording")
    add_file(recover, "that is cut or damaged")
    recover.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="OUT",
        help="the whole file that is made (FILE.recovered.mcap)",
    )
    check = add("check", verbs.check, "hold every message of a recording against the rules")
    add_file(check)
    echo = add("echo", verbs.echo, "print messages, live or from a recording, one line each")
    echo.add_argument("key", nargs="+", metavar="KEY", help=_KEYS)
    echo.add_argument("--full", action="store_true", help="every number of every array")
    hz = add("hz", verbs.hz, "print how often messages come, live or from a recording")
    hz.add_argument("keys", nargs="*", metavar="KEY", help=f"{_KEYS} (all)")
    hz.add_argument(
        "--every", type=float, default=1.0, metavar="S", help="live: seconds between two tables (1)"
    )
    for looking, what in ((echo, "messages"), (hz, "tables")):
        looking.add_argument("--file", type=_file, metavar="FILE", help="a recording, not the bus")
        looking.add_argument(
            "-n",
            "--count",
            type=int,
            default=0,
            metavar="COUNT",
            help=f"stop after so many {what} (0: never)",
        )


def _file(text: str) -> Path:
    path = Path(text)
    if not path.is_dir():
        return path
    from quadriga.recordings.summary import RECORDING

    return path / RECORDING
