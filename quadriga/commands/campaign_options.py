"""Options of `quadriga campaign`."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from quadriga.commands import campaign as verb
from quadriga.commands.command import AddCommand
from quadriga.shared.errors import ConfigError


def add_campaign(add: AddCommand) -> None:
    """The command itself."""
    command = add("campaign", verb.campaign, "walk variants in the same worlds, and report on them")
    option = command.add_argument
    option("scenarios", nargs="*", metavar="SCENARIO", help="a scenario's name, or its TOML file")
    option(
        "--planners",
        action="append",
        default=[],
        metavar="LIST",
        help="variants, separated by commas: names of planners, tables of --variants, or "
        "name:section.key=value;section.key=value (none,distributed)",
    )
    option("--variants", type=Path, metavar="FILE", help="TOML: a table of keys for each variant")
    option("--baseline", metavar="NAME", help="what others are compared with (none or the first)")
    option(
        "--seeds", metavar="LIST", help=f"of the worlds: 0:20 is 0 … 19; 1,5 is both ({verb.SEEDS})"
    )
    option(
        "--sweep",
        action="append",
        default=[],
        metavar="KEY=V,V",
        help="with each of these values: world.terrain_height=0.04,0.08, or of a text: "
        "'world.push=r1:{80,120}:90:3:0.2'; may be repeated",
    )
    add_where(command)
    option(
        "--out",
        type=Path,
        metavar="DIR",
        help="folder, new or of a campaign to go on with (runs/<date>-<time>)",
    )
    option(
        "--report",
        type=Path,
        metavar="DIR",
        help="walk nothing: write the report of this folder anew",
    )
    option(
        "--record-worst",
        type=int,
        default=0,
        metavar="K",
        help="walk the K worst seeds of each group again over the bus, and link the recordings",
    )


def add_where(command: argparse.ArgumentParser) -> None:
    """Where trials are walked."""
    option = command.add_argument
    option(
        "--jobs",
        type=_jobs,
        default=_cores(),
        metavar="N|auto",
        help="walks side by side (auto: one for each core)",
    )
    option(
        "--dask",
        nargs="?",
        const="local",
        metavar="tcp://HOST:PORT",
        help="walk on the workers of a Dask scheduler; without an address on those of a "
        "cluster made here",
    )


def dask_of(arguments: argparse.Namespace, before: str) -> str | None:
    """The scheduler asked for, None without one; names of what is walked stand `before` it.

    Raises:
        ConfigError: it is no address.
    """
    dask: str | None = arguments.dask
    if dask not in (None, "local") and "://" not in dask:
        raise ConfigError("--dask", repr(dask), "tcp://HOST:PORT", f"{before} come before it")
    return dask


def _jobs(text: str) -> int:
    jobs = _cores() if text == "auto" else int(text)
    if jobs < 1:
        raise argparse.ArgumentTypeError(f"got {jobs}, expected auto or at least 1")
    return jobs


def _cores() -> int:
    return len(os.sched_getaffinity(0))
