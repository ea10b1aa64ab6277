"""Options that several commands have."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

KEY_HELP: Final = "a topic, a robot or a key: plan, r2, r1/state, 'r*/**'"


def named_path(text: str) -> Path:
    """A file or a folder that is named: Python takes no name for the working directory."""
    if not text:
        raise argparse.ArgumentTypeError("got '', expected the name of a file or a folder")
    return Path(text)


def _number(kind: type) -> Callable[[str], Any]:
    def convert(text: str) -> Any:
        if "_" in text or not text.isascii():  # as Python writes numbers, and nobody else
            raise ValueError
        return kind(text)

    convert.__name__ = kind.__name__
    return convert


# How words become values, by the type that an option has.
READ_AS: Final[dict[Any, Callable[[str], Any]]] = {
    int: _number(int),
    float: _number(float),
    Path: named_path,
}


def add_file(command: argparse.ArgumentParser, what: str = "") -> None:
    """The recording that a command reads."""
    doc = f"a recording {what}".rstrip()
    command.add_argument(
        "file", type=recording_path, metavar="FILE", help=f"{doc}, or its run folder"
    )


def recording_path(text: str) -> Path:
    """The recording that a user names by its file or its run folder."""
    path = named_path(text)
    if not path.is_dir():
        return path
    from quadriga.recordings.readable import recording_of

    return recording_of(path)


def add_source(command: argparse.ArgumentParser, what: str) -> None:
    """Where messages are read from, and after how many of `what` to stop."""
    command.add_argument(
        "--file", type=recording_path, metavar="FILE", help="a recording, not the bus"
    )
    command.add_argument(
        "-n",
        "--count",
        type=int,
        default=0,
        metavar="COUNT",
        help=f"stop after so many {what} (0: never)",
    )


def add_predictor(command: argparse.ArgumentParser) -> None:
    """The predictor of a process that plans."""
    command.add_argument("--predictor", type=Path, metavar="FILE", help="instead of the cached one")


def add_wait(command: argparse.ArgumentParser) -> None:
    """How long a process waits for what another one makes."""
    command.add_argument(
        "--wait",
        type=float,
        default=0.0,
        metavar="S",
        help="wait so long for the predictor to be made (0)",
    )


def add_no_render(command: argparse.ArgumentParser) -> None:
    """A report without rendered pictures."""
    command.add_argument("--no-render", action="store_true", help="no pictures of the walk")
