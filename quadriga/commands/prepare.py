"""`quadriga prepare`: what the first walk would have to wait for."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import Config
from quadriga.shared.planner_kinds import find_kind


def add(add_command: AddCommand) -> None:
    add_command("prepare", run, "collect, fit and compile what a walk needs, beforehand")


def run(_arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Compile, then print the predictor's file if the team plans."""
    from rich.console import Console

    from quadriga.identification.predictors import ensure_data, ensure_predictor
    from quadriga.warm_up import warm_up

    console = Console(stderr=True)
    warm_up(config, console)
    kind = find_kind(config.planner.kind)
    if kind.needs_data:
        ensure_data(config, console)
    if kind.needs_predictor:
        print(ensure_predictor(config, console))
    return 0
