"""The command `experiments`. It imports what it needs: every process reads the command line."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import Any

from rich.console import Console

from shared.config import Config
from shared.errors import ConfigError


def experiments(arguments: argparse.Namespace, _config: Config, _given: dict[str, Any]) -> int:
    """Walk what is missing of experiments, then publish what came of all."""
    from quadriga.campaign.options import dask_of
    from quadriga.experiments.catalogue import CHECKOUT, load
    from quadriga.experiments.publish import PAGE, checked, publish
    from quadriga.experiments.sheets import requirement_sheet
    from quadriga.experiments.walk import check_folders, plans_of, walk
    from quadriga.sheet import show
    from quadriga.variants import seeds_of

    _check_options(arguments)
    every, asked = load(arguments.names)
    into = arguments.into or CHECKOUT
    checked(into)  # this and the folders: better known before hours of walking
    if not arguments.only_publish:
        dask = dask_of(arguments, "names")
        seeds = seeds_of("--seeds", arguments.seeds) if arguments.seeds else ()
        console = Console(stderr=True)
        known = {experiment.name: experiment for experiment in every}
        plans = {name: plans_of(known[name], seeds) for name in asked}
        for name in asked:
            check_folders(known[name], arguments.out)
        for name in asked:
            walk(known[name], plans[name], arguments.out, jobs=arguments.jobs, dask=dask,
                 typed=arguments.typed, console=console)  # fmt: skip
            publish(every, arguments.out, into)
    entries = publish(every, arguments.out, into)
    found = [(entry.experiment, requirement_sheet(entry.experiment, entry.results))
             for entry in entries if entry.experiment.name in asked]  # fmt: skip
    show(
        replace(sheet, title=experiment.title,
                rows=tuple(tuple(cell.replace("**", "") for cell in row) for row in sheet.rows))
        for experiment, sheet in found if sheet.rows
    )  # fmt: skip
    print(into / PAGE)
    return 0


def _check_options(arguments: argparse.Namespace) -> None:
    given = {**arguments.overrides, "--config": arguments.config, "--scenario": arguments.scenario}
    for name, value in given.items():
        if value is not None:
            raise ConfigError(name, str(value), "no key",
                              "those of an experiment stand in its file")  # fmt: skip
    if arguments.only_publish and arguments.seeds:
        raise ConfigError("--seeds", repr(arguments.seeds), "none", "--only-publish walks nothing")
