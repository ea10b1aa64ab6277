"""What an operator types: the command line, its options and its exit statuses."""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from quadriga.commands import process_verbs, verbs
from quadriga.commands import recording_options as recording_cli
from quadriga.commands.campaign_options import add_campaign
from quadriga.commands.experiments_options import add_experiments
from quadriga.commands.recording_options import add_file
from quadriga.shared.config.load import build, layers, parse_assignment
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError, ProcessError, QuadrigaError
from quadriga.shared.runtime.signals import die_with_parent, interrupt_on_sigterm
from quadriga.team.scenarios import LABEL, label, path

FAILED: Final = 1  # a robot fell or a process failed
WRONG: Final = 2  # the command, the configuration or a file is wrong
INTERRUPTED: Final = 130

# Options that set one key of the configuration each; the key's own documentation is their help.
KEYS: Final = {
    "robots": "team.robots", "yokes": "team.yokes", "team": "team.name",
    "seconds": "world.seconds", "mode": "world.mode", "seed": "world.seed",
    "terrain": "world.terrain", "terrain-height": "world.terrain_height",
    "payload": "world.payload", "payload-on": "world.payload_on", "push": "world.push",
    "vx": "reference.vx", "vy": "reference.vy", "wz": "reference.wz",
    "planner": "planner.kind", "interface": "planner.interface", "estimator": "estimator.kind",
    "preset": "controller.preset", "endpoint": "bus.endpoint",
}  # fmt: skip


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; its exit status. A user's mistake costs one line, not a traceback."""
    typed = sys.argv[1:] if argv is None else list(argv)
    arguments = parser().parse_args(typed)
    arguments.typed = shlex.join(["quadriga", *typed])
    try:
        interrupt_on_sigterm()
        if arguments.parent:
            die_with_parent(arguments.parent)
        status: int = arguments.verb(arguments, *_configuration(arguments))
    except ProcessError as error:
        return _complain(error, FAILED)
    except QuadrigaError as error:
        return _complain(error, WRONG)
    except KeyboardInterrupt:
        print("quadriga: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # of `quadriga config | head`
        sys.stdout = None
        return 0
    except OSError as error:  # a disk that is full, a folder that is read-only
        what, reason = error.filename or "a file or a connection", error.strerror or str(error)
        return _complain(ConfigError(str(what), reason, "one that can be used"), WRONG)
    return status


def parser() -> argparse.ArgumentParser:
    """The parser of the whole command line."""
    top = argparse.ArgumentParser(
        prog="quadriga",
        description="A team of yoked quadrupeds that walk as one.",
        epilog="Every command reads one configuration: defaults, then --scenario, then --config, "
        "then options.",
    )
    commands = top.add_subparsers(metavar="command", required=True)
    shared_options = _config_options()

    def add(name: str, verb: Any, doc: str) -> argparse.ArgumentParser:
        command = commands.add_parser(
            name, help=doc, description=doc, parents=[shared_options], allow_abbrev=False
        )
        command.set_defaults(verb=verb)
        return command

    walk = add("walk", verbs.walk, "start all processes, walk, and show what came of it")
    walk.add_argument("--out", type=Path, metavar="DIR", help="run folder (runs/<date>-<time>)")
    walk.add_argument("--no-render", action="store_true", help="no pictures of the walk")
    add("scenarios", verbs.scenarios, "list the scenarios that can be walked, and what they are")
    add("sim", process_verbs.sim, "the sim server alone")
    agent = add("agent", process_verbs.agent, "the agent of one robot")
    agent.add_argument("--robot", required=True, metavar="NAME", help="r1 … rn")
    agent.add_argument("--predictor", type=Path, metavar="FILE", help="instead of the cached one")
    plan = add(
        "plan",
        process_verbs.plan,
        "the planner of the whole team (planner.kind centralised, deepc)",
    )
    plan.add_argument("--predictor", type=Path, metavar="FILE", help="instead of the cached one")
    record = add("record", process_verbs.record, "record the traffic of a team to an MCAP file")
    recording_cli.add_record_options(record)
    for waiting in (agent, plan, record):
        waiting.add_argument(
            "--wait",
            type=float,
            default=0.0,
            metavar="S",
            help="wait so long for the predictor to be made (0)",
        )
    report = add("report", verbs.report, "show what came of a recorded walk")
    report.add_argument(
        "run", type=Path, metavar="FILE|DIR", help="a recording, or the folder of a run.mcap"
    )
    report.add_argument(
        "--html",
        type=Path,
        metavar="FILE",
        help="the page of a recording's FILE (its name with .html)",
    )
    report.add_argument("--no-render", action="store_true", help="no pictures of the walk")
    _add_play(add("play", verbs.play, "put a recording back on the bus"))
    resim = add("resim", verbs.resim, "re-simulate a recorded world and compare it to the byte")
    add_file(resim, "of a lock-step walk")
    export = add("export", verbs.export, "convert a recording for other tools")
    add_file(export)
    export.add_argument(
        "--to",
        required=True,
        choices=("foxglove", "rerun", "csv", "parquet"),
        help="MCAP for Foxglove or Rerun, or one table per key",
    )
    export.add_argument(
        "-o", "--output", type=Path, metavar="OUT", help="a new file or folder (beside FILE)"
    )
    recording_cli.add_verbs(add)
    _add_replay(
        add(
            "replay",
            verbs.replay,
            "run recorded agents again and compare what they say to the byte",
        )
    )
    router = add("router", process_verbs.router, "the router between processes in client mode")
    router.add_argument("--listen", metavar="ENDPOINT", help="where (bus.endpoint)")
    router.add_argument("--once", action="store_true", help="leave when the team has walked")
    add("prepare", verbs.prepare, "collect, fit and compile what a walk needs, beforehand")
    add("operate", process_verbs.operate, "publish the velocity reference of the configuration")
    add("collect", verbs.collect, "collect the data a predictor is fitted to")
    fit = add("fit", verbs.fit, "fit the predictor, hold it against its gates and report on it")
    fit.add_argument(
        "--all",
        action="store_true",
        help="every predictor there is, on the same data, in one table",
    )
    _add_comparison(
        add("compare", verbs.compare, "compare planners and predictors in the same worlds")
    )
    add_campaign(add)
    add_experiments(add)
    estop = add("estop", process_verbs.estop, "stop the team at once: every joint is damped")
    estop.add_argument("--reason", default="operator", help="told to every agent")
    config = add("config", verbs.show_config, "print the configuration in force as TOML")
    config.add_argument("--markdown", action="store_true", help="as documentation instead")
    add("version", verbs.version, "print the version")
    return top


def _add_play(play: argparse.ArgumentParser) -> None:
    play.epilog = "Keys in a terminal: space pauses, right arrow plays one planning step, q quits."
    add_file(play)
    play.add_argument(
        "-r",
        "--rate",
        type=float,
        default=1.0,
        metavar="X",
        help="world time per wall time (%(default)g)",
    )
    play.add_argument(
        "--start", type=float, default=0.0, metavar="S", help="begin at this world time [s]"
    )
    play.add_argument("--loop", action="store_true", help="begin again at the end")
    play.add_argument("--paused", action="store_true", help="begin paused")
    play.add_argument(
        "--topics",
        nargs="+",
        default=["*"],
        metavar="GLOB",
        help="keys to play, with or without the team: 'r1/*' sim/truth",
    )
    play.add_argument(
        "--remap",
        nargs="+",
        action="extend",
        default=[],
        metavar="FROM:TO",
        help="first parts of keys to replace: team:ghost",
    )
    play.add_argument(
        "--clock",
        choices=("world", "log"),
        default="world",
        help="time that paces: the world's or that of recording (%(default)s)",
    )


def _add_replay(replay: argparse.ArgumentParser) -> None:
    replay.epilog = (
        "Exit status: 0 if every recorded command, plan and measurement is recomputed to the byte, "
        "however many the recorder lost; 1 if one differs or an input is not in the recording; "
        "with a change always 0."
    )
    add_file(replay)
    whom = replay.add_mutually_exclusive_group(required=True)
    whom.add_argument("--robot", metavar="NAME", help="r1 … rn")
    whom.add_argument("--all", action="store_true", help="every robot of the team")
    replay.add_argument(
        "--predictor",
        type=Path,
        metavar="FILE",
        help="the team's, or another to see what it changes",
    )
    replay.add_argument(
        "--break",
        type=float,
        metavar="S",
        dest="stop_at",
        help="stop in the debugger before the step at this time [s]",
    )
    replay.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="where figures and problems go (beside the recording)",
    )


def _add_comparison(compare: argparse.ArgumentParser) -> None:
    for option, default, doc in (
        ("planners", "none,decentralised,distributed,centralised", "planners"),
        ("predictors", "ridge,pinv,causal,arx", "predictors"),
        ("scenarios", "flat", "worlds"),
        ("seeds", "0:3", "seeds of the worlds: 0:3 is 0, 1, 2; 1,5 is both"),
    ):
        named = "" if option == "seeds" else "; '?' lists the names"
        compare.add_argument(
            f"--{option}",
            default=default,
            metavar="LIST",
            help=f"{doc}, separated by commas{named} ({default})",
        )
    compare.add_argument(
        "--product", action="store_true", help="every planner with every predictor"
    )
    compare.add_argument(
        "--jobs",
        type=int,
        default=os.cpu_count() or 1,
        metavar="N",
        help="walks side by side (%(default)s)",
    )
    compare.add_argument(
        "--bus", action="store_true", help="each walk as processes of its own, one after the other"
    )
    compare.add_argument("--out", type=Path, metavar="DIR", help="folder (runs/<date>-<time>)")


def _config_options() -> argparse.ArgumentParser:
    options = argparse.ArgumentParser(add_help=False)
    options.add_argument("--parent", type=int, default=0, help=argparse.SUPPRESS)
    group = options.add_argument_group("configuration")
    group.add_argument(
        "--scenario",
        metavar="NAME",
        help="start from a scenario's keys; see `quadriga scenarios`; --config and "
        "all other options win over it; a TOML file will do, too",
    )
    group.add_argument("--config", type=Path, metavar="FILE", help="TOML; see `quadriga config`")
    group.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="SECTION.KEY=VALUE",
        dest="assignments",
        help="set any key; may be repeated",
    )
    for option, name in KEYS.items():
        section, _, key = name.partition(".")
        values = getattr(Config(), section)
        meta = type(values).__dataclass_fields__[key].metadata
        unit = "" if meta["unit"] in ("-", "1") else f" [{meta['unit']}]"
        kind = type(getattr(values, key))
        group.add_argument(
            f"--{option}",
            type=kind,
            dest=name,
            metavar="|".join(meta["choices"]) or "X",
            help=f"{meta['doc']}{unit} ({getattr(values, key)})".replace("%", "%%"),
        )
    return options


def _configuration(arguments: argparse.Namespace) -> tuple[Config, dict[str, Any]]:
    """The configuration in force, and what of it is given explicitly."""
    overrides = dict(parse_assignment(text) for text in arguments.assignments)
    for name in KEYS.values():
        if (value := getattr(arguments, name)) is not None:
            overrides[name] = value
    arguments.overrides = overrides
    scenario = arguments.scenario
    if scenario is None:
        given = layers(arguments.config, overrides)
    else:
        named = {LABEL: label(scenario)} | overrides
        given = layers(arguments.config, named, beneath=path(scenario))
    return build(given), given


def _complain(error: QuadrigaError, status: int) -> int:
    print(f"quadriga: {error}", file=sys.stderr)
    return status
