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
    moment = command.add_mutually_exclusive_group()
    moment.add_argument(
        "--save-qp",
        type=float,
        metavar="S",
        help="save the whole-body QP and the planner's from this time on [s]",
    )
    moment.add_argument(
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
    saving = arguments.save_qp is not None
    moment = arguments.save_qp if saving else arguments.stop_at
    if moment is None:
        robots = () if arguments.all else (robot,)
        outcomes = replay(path, robots, *options, Console(stderr=True))
    elif arguments.all:
        option = "--save-qp" if saving else "--break"
        raise ConfigError(option, "--all", "--robot NAME", "one moment of one robot")
    else:
        outcomes = [replay_to_breakpoint(path, robot, *options, moment, save_qp=saving)]
    for outcome in outcomes:
        print(printable(format_outcome(outcome)))
    recording, failed = Recording(path), any(outcome.failed for outcome in outcomes)
    others = differing_versions(recording.metadata) if failed else ""
    if others:
        print(printable(f"recorded with other versions, which may be why: {others}"))
    recording.require_whole()
    return int(failed)
