"""`quadriga play`: a recording back on the bus."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given
from quadriga.commands.options import add_file
from quadriga.shared.config.sections import Config


def add(add_command: AddCommand) -> None:
    command = add_command("play", run, "put a recording back on the bus")
    command.epilog = (
        "Keys in a terminal: space pauses, right arrow plays one planning step, q quits."
    )
    add_file(command)
    option = command.add_argument
    option(
        "-r",
        "--rate",
        type=float,
        default=1.0,
        metavar="X",
        help="world time per wall time (%(default)g)",
    )
    option("--start", type=float, default=0.0, metavar="S", help="begin at this world time [s]")
    option("--loop", action="store_true", help="begin again at the end")
    option("--paused", action="store_true", help="begin paused")
    option(
        "--topics",
        nargs="+",
        default=["*"],
        metavar="GLOB",
        help="keys to play, with or without the team: 'r1/*' sim/truth",
    )
    option(
        "--remap",
        nargs="+",
        action="extend",
        default=[],
        metavar="FROM:TO",
        help="first parts of keys to replace: team:ghost",
    )
    option(
        "--clock",
        choices=("world", "log"),
        default="world",
        help="time that paces: the world's or that of recording (%(default)s)",
    )


def run(arguments: argparse.Namespace, config: Config, given: Given) -> int:
    """Play until the recording's end, a `q` or a signal."""
    from rich.console import Console

    from quadriga.playback.play import play
    from quadriga.playback.timeline import Timeline, parse_remap
    from quadriga.shared.recording.reader import Recording

    remaps = [parse_remap(text) for text in arguments.remap]
    recording = Recording(arguments.file)
    if "name" in given.get("team", {}):
        remaps.append((recording.metadata.get("team", ""), config.team.name))
    play(
        config.bus,
        Timeline(recording, arguments.topics, remaps, arguments.clock),
        Console(),
        rate=arguments.rate,
        start=arguments.start,
        loop=arguments.loop,
        paused=arguments.paused,
    )
    recording.require_whole()
    return 0
