"""`quadriga replay`: recorded agents, run again."""

from __future__ import annotations

import argparse
from pathlib import Path

from quadriga.commands.command import AddCommand, Given
from quadriga.commands.options import add_file
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.printable import printable


def add(add_command: AddCommand) -> None:
    command = add_command(
        "replay", run, "run recorded agents again and compare what they say to the byte"
    )
    command.epilog = (
        "Exit status: 0 if every recorded command, plan and measurement is recomputed to the byte, "
        "however many the recorder lost; 1 if one differs or an input is not in the recording; "
        "with a change always 0."
    )
    add_file(command)
    robots = command.add_mutually_exclusive_group(required=True)
    robots.add_argument("--robot", metavar="NAME", help="r1 … rn")
    robots.add_argument("--all", action="store_true", help="every robot of the team")
    command.add_argument(
        "--predictor",
        type=Path,
        metavar="FILE",
        help="the team's, or another to see what it changes",
    )
    command.add_argument(
        "--break",
        type=float,
        metavar="S",
        dest="stop_at",
        help="stop in the debugger before the step at this time [s]",
    )
    command.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="where figures and problems go (beside the recording)",
    )


def run(arguments: argparse.Namespace, _config: Config, given: Given) -> int:
    """Replay with the recording's configuration and what is `given`; 1 if something differs."""
    from rich.console import Console

    from quadriga.recordings.metadata import differing_versions
    from quadriga.replay.outcome import format_outcome
    from quadriga.replay.team_replay import replay, replay_to_breakpoint
    from quadriga.shared.recording.reader import Recording

    path, robot = arguments.file, arguments.robot
    options = (given, arguments.predictor, arguments.out)
    if arguments.stop_at is None:
        robots = () if arguments.all else (robot,)
        outcomes = replay(path, robots, *options, Console(stderr=True))
    elif arguments.all:
        raise ConfigError("--break", "--all", "--robot NAME", "one debugger, one robot")
    else:
        outcomes = [replay_to_breakpoint(path, robot, *options, arguments.stop_at)]
    for outcome in outcomes:
        print(printable(format_outcome(outcome)))
    recording, failed = Recording(path), any(outcome.failed for outcome in outcomes)
    others = differing_versions(recording.metadata) if failed else ""
    if others:
        print(printable(f"recorded with other versions, which may be why: {others}"))
    recording.require_whole()
    return int(failed)
