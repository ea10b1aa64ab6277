"""`quadriga collect`: the data that predictors are fitted to."""

from __future__ import annotations

import argparse

from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import Config


def add(add_command: AddCommand) -> None:
    add_command("collect", run, "collect the data a predictor is fitted to")


def run(_arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Collect data unless there are some."""
    from rich.console import Console

    from quadriga.identification.cache import data_path
    from quadriga.identification.predictors import ensure_data
    from quadriga.shared.topics import SAMPLE_MS

    dataset = ensure_data(config, Console(stderr=True))
    seconds = 1e-3 * SAMPLE_MS * sum(episode.samples for episode in dataset.training)
    print(f"{data_path(config)}\n{len(dataset.training)} episodes, {seconds:.0f} s for the fit")
    return 0
