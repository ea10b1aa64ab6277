"""`quadriga recover`: a whole file from what is left of a damaged one."""

from __future__ import annotations

import argparse
from pathlib import Path

from quadriga.commands.command import AddCommand, Given
from quadriga.commands.options import add_file
from quadriga.shared.config.sections import Config
from quadriga.shared.printable import printable


def add(add_command: AddCommand) -> None:
    command = add_command("recover", run, "write what is readable of a damaged recording")
    add_file(command, "that is cut or damaged")
    command.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="OUT",
        help="the whole file that is made (FILE.recovered.mcap)",
    )


def run(arguments: argparse.Namespace, _config: Config, _given: Given) -> int:
    """Recover a recording and print what could not be."""
    from quadriga.recordings.recover import format_recovery, recover

    recovery = recover(arguments.file, arguments.output)
    if recovery is None:
        print(f"{arguments.file} is whole: nothing to recover")
        return 0
    print(f"damaged: {recovery.error.got}")
    print(printable("\n".join(format_recovery(recovery))))
    return 0
