"""`quadriga plan`: the process of a planner that plans for the whole team."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given
from quadriga.commands.fitted_predictor import load_predictor
from quadriga.commands.options import add_predictor, add_wait
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.planner_kinds import find_kind


def add(add_command: AddCommand) -> None:
    command = add_command(
        "plan", run, "the planner of the whole team (planner.kind centralised, deepc)"
    )
    add_predictor(command)
    add_wait(command)


def run(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Run the planner until the walk is over."""
    from quadriga.agents import central_process
    from quadriga.agents.predictor.store import predictor_sha256
    from quadriga.identification.central_planner import build_central_planner

    kind = find_kind(config.planner.kind)
    if not kind.central:
        raise ConfigError(
            "planner.kind",
            repr(kind.name),
            "a kind that is one process for the team, such as centralised",
            "in all other kinds each agent plans for itself",
        )
    predictor = load_predictor(config, arguments) if kind.needs_predictor else None
    sha256 = "" if predictor is None else predictor_sha256(predictor)
    planner = build_central_planner(config, predictor)
    central_process.run(config, planner, predictor_sha256=sha256)
    return 0
