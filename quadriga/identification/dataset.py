"""Collected data: episodes to fit on and episodes held out, in memory and in a file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from quadriga.agents.predictor import regression
from quadriga.agents.predictor.episode import SIGNALS, Episode, team_layout
from quadriga.agents.predictor.hankel import required_samples
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError, PredictorFileError
from quadriga.shared.robots.conventions import N_FORCES, Array
from quadriga.shared.runtime.atomic import atomic_write
from quadriga.shared.runtime.npz import UNREADABLE, open_npz

_FIELDS: Final = (*SIGNALS, "first_tick")


@dataclass(frozen=True, slots=True)
class Dataset:
    """What was collected: episodes to fit on, the seed of each, and episodes held out."""

    training: tuple[Episode, ...]
    held_out: tuple[Episode, ...]
    seeds: tuple[int, ...]


def check_excitation(config: Config, training: Sequence[Episode]) -> None:
    """Enough samples by the rule T ≥ (m+1)(T_ini+N+n)−1, and inputs persistently exciting.

    Raises:
        PredictorError: too few samples, or inputs that leave directions unexcited.
    """
    n, planner = config.team.robots, config.planner
    order = config.identification.order_per_robot * n
    required = required_samples(N_FORCES * n, planner.T_ini, planner.N, order)
    samples = sum(episode.samples for episode in training)
    if samples < required:
        raise PredictorError(
            "collected data",
            f"{samples} samples",
            f"at least {required} by (m+1)(T_ini+N+n)−1",
            "collect more: identification.seconds, or fewer falls",
        )
    layout = team_layout(n, planner.T_ini, planner.N)
    inputs = [episode.scaled_deviations(layout)[0] for episode in training]
    regression.check_excitation(inputs, planner.T_ini + planner.N + order)


def write_data(path: Path, dataset: Dataset) -> None:
    """Keep collected data; a file half written never has the name `path`."""
    path.parent.mkdir(parents=True, exist_ok=True)
    arrays = {"seeds": np.array(dataset.seeds, dtype=np.int64)} | {
        f"{part}.{k}.{name}": np.asarray(getattr(episode, name))
        for part in ("training", "held_out")
        for k, episode in enumerate(getattr(dataset, part))
        for name in _FIELDS
    }
    with atomic_write(path) as partial, partial.open("wb") as file:
        np.savez(file, **arrays)


def read_data(path: Path) -> Dataset:
    """Collected data from a file.

    Raises:
        PredictorFileError: no such file, or not a file of collected data.
    """
    try:
        with open_npz(path) as archive:
            arrays = {name: archive[name] for name in archive.files}
        parts: dict[str, tuple[Episode, ...]] = {}
        for part in ("training", "held_out"):
            count = len({name.split(".")[1] for name in arrays if name.startswith(part)})
            parts[part] = tuple(_episode(arrays, f"{part}.{k}") for k in range(count))
        seeds = tuple(arrays["seeds"].tolist())
    except UNREADABLE as error:
        raise PredictorFileError(
            f"data {path}",
            str(error) or type(error).__name__,
            "a file of `quadriga collect`",
            "delete it to collect anew",
        ) from None
    return Dataset(**parts, seeds=seeds)


def _episode(arrays: dict[str, Array], name: str) -> Episode:
    signals = {signal: arrays[f"{name}.{signal}"] for signal in SIGNALS}
    return Episode(**signals, first_tick=int(arrays[f"{name}.first_tick"]))
