"""`quadriga whatif`: a recorded walk once more, with something changed from a moment on."""

from __future__ import annotations

import argparse
from pathlib import Path

from quadriga.commands.command import AddCommand, Given
from quadriga.commands.options import add_file
from quadriga.shared.config.sections import Config
from quadriga.shared.printable import printable


def add(add_command: AddCommand) -> None:
    command = add_command(
        "whatif", run, "walk a recorded walk once more, with something changed from a moment on"
    )
    command.epilog = (
        "Up to the moment the walk is the recorded one, to the byte; from there on world and "
        "agents go on by themselves with what is changed. Settings of the world are in force from "
        "its beginning, and refused if the recorded walk feels them before the moment."
    )
    add_file(command, "of a lock-step walk")
    option = command.add_argument
    option("--from", type=float, required=True, metavar="S", dest="seconds", help="the moment [s]")
    option("--robot", action="append", metavar="NAME", help="change its agent alone (all)")
    option("--predictor", type=Path, metavar="FILE", help="another one for the changed agents")
    option("--out", type=Path, metavar="DIR", help="where the figure goes (beside the recording)")


def run(arguments: argparse.Namespace, _config: Config, given: Given) -> int:
    """Walk on with the recording's configuration and what is `given`."""
    from rich.console import Console

    from quadriga.shared.errors import RecordingError, name_file_errors
    from quadriga.shared.recording.reader import Recording
    from quadriga.tables import print_tables
    from quadriga.what_if.what_if import WhatIf, answer_what_if

    path, robots = arguments.file, tuple(arguments.robot or ())
    out = arguments.out or path.parent
    with name_file_errors(RecordingError, f"--out {out}", "a folder that can be made"):
        out.mkdir(parents=True, exist_ok=True)
    question = WhatIf(path, arguments.seconds, given, arguments.predictor, robots, out)
    answer = answer_what_if(question, Console(stderr=True))
    print_tables([answer.table])
    parted = "never" if answer.parted is None else f"at {1e-3 * answer.parted:g} s"
    print(f"{answer.equal} states equal to the recorded ones to the byte; the walks part {parted}")
    print(printable(f"figure: {answer.figure}"))
    Recording(path).require_whole()
    return 0
