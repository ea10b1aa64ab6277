"""`quadriga replay`: recorded agents, their world, or both with something changed, run again."""

from __future__ import annotations

import argparse
from pathlib import Path

from quadriga.commands.command import AddCommand, Given, check_options_beside, refuse_configuration
from quadriga.commands.options import add_file
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.printable import printable


def add(add_command: AddCommand) -> None:
    command = add_command(
        "replay", run, "run recorded agents or their world again and compare to the byte"
    )
    command.epilog = (
        "Exit status: 0 if every recorded command, plan and measurement (with --world every state "
        "and ground truth) is recomputed to the byte, however many the recorder lost; 1 if one "
        "differs or an input is not in the recording; with a change always 0. With --from the walk "
        "is the recorded one up to the moment, to the byte; from there on world and agents go on "
        "by themselves with what is changed. Settings of the world are in force from its "
        "beginning, and refused if the recorded walk feels them before the moment."
    )
    add_file(command)
    what = command.add_mutually_exclusive_group()
    what.add_argument(
        "--robot", action="append", metavar="NAME", help="its agent, r1 … rn; may be repeated"
    )
    what.add_argument("--all", action="store_true", help="the agent of every robot")
    what.add_argument(
        "--world", action="store_true", help="the simulated world alone, of a lock-step walk"
    )
    command.add_argument(
        "--predictor",
        type=Path,
        metavar="FILE",
        help="the team's, or another to see what it changes",
    )
    moment = command.add_mutually_exclusive_group()
    moment.add_argument(
        "--from",
        type=float,
        metavar="S",
        dest="begin",
        help="from this time [s] of a lock-step walk on, let world and agents go on by themselves "
        "with what is changed, for --robot or for all",
    )
    moment.add_argument(
        "--save-qp",
        type=float,
        metavar="S",
        help="save the whole-body QP of a robot and its planner's from this time on [s]",
    )
    moment.add_argument(
        "--break",
        type=float,
        metavar="S",
        dest="stop_at",
        help="stop in the debugger before a robot's step at this time [s]",
    )
    command.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="where figures and problems go (beside the recording)",
    )


def run(arguments: argparse.Namespace, _config: Config, given: Given) -> int:
    """Replay with the recording's configuration and what is `given`; 1 if something differs."""
    from quadriga.shared.recording.reader import Recording

    if arguments.world:
        status = _replay_world(arguments, given)
    elif arguments.begin is not None:
        status = _walk_on(arguments, given)
    elif arguments.robot or arguments.all:
        status = _replay_agents(arguments, given)
    else:
        expected = "--robot NAME, --all, --world or --from S"
        raise ConfigError("replay", "nothing to run again", expected)
    Recording(arguments.file).require_whole()
    return status


def _replay_world(arguments: argparse.Namespace, given: Given) -> int:
    from rich.console import Console

    from quadriga.replay.compare_world import compare_world

    others = {
        "--from": arguments.begin,
        "--predictor": arguments.predictor,
        "--save-qp": arguments.save_qp,
        "--break": arguments.stop_at,
        "--out": arguments.out,
    }
    check_options_beside("--world", True, needing={}, excluding=others)
    refuse_configuration(given)
    return int(not compare_world(arguments.file, Console()))


def _replay_agents(arguments: argparse.Namespace, given: Given) -> int:
    from rich.console import Console

    from quadriga.recordings.metadata import differing_versions
    from quadriga.replay.outcome import format_outcome
    from quadriga.replay.team_replay import replay, replay_to_breakpoint
    from quadriga.shared.recording.reader import Recording

    path, robots = arguments.file, tuple(dict.fromkeys(arguments.robot or ()))
    options = (given, arguments.predictor, arguments.out)
    saving = arguments.save_qp is not None
    moment = arguments.save_qp if saving else arguments.stop_at
    if moment is None:
        outcomes = replay(path, robots, *options, Console(stderr=True))
    elif len(robots) != 1:
        option, got = "--save-qp" if saving else "--break", " ".join(robots) or "--all"
        raise ConfigError(option, got, "--robot NAME", "one moment of one robot")
    else:
        outcomes = [replay_to_breakpoint(path, robots[0], *options, moment, save_qp=saving)]
    for outcome in outcomes:
        print(printable(format_outcome(outcome)))
    failed = any(outcome.failed for outcome in outcomes)
    others = differing_versions(Recording(path).metadata) if failed else ""
    if others:
        print(printable(f"recorded with other versions, which may be why: {others}"))
    return int(failed)


def _walk_on(arguments: argparse.Namespace, given: Given) -> int:
    """Walk on from a moment, changed, and show both walks side by side."""
    from rich.console import Console

    from quadriga.shared.errors import RecordingError, name_file_errors
    from quadriga.tables import print_tables
    from quadriga.what_if.what_if import WhatIf, answer_what_if

    path, robots = arguments.file, tuple(dict.fromkeys(arguments.robot or ()))
    out = arguments.out or path.parent
    with name_file_errors(RecordingError, f"--out {out}", "a folder that can be made"):
        out.mkdir(parents=True, exist_ok=True)
    question = WhatIf(path, arguments.begin, given, arguments.predictor, robots, out)
    answer = answer_what_if(question, Console(stderr=True))
    print_tables([answer.table])
    parted = "never" if answer.parted is None else f"at {1e-3 * answer.parted:g} s"
    print(f"{answer.equal} states equal to the recorded ones to the byte; the walks part {parted}")
    print(printable(f"figure: {answer.figure}"))
    return 0
