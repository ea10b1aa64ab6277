"""A cache in which a team has data already: of linear robots, whose true response is known."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from quadriga.identification.cache import data_path
from quadriga.identification.dataset import Dataset, write_data
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from tests.agents.conftest import LinearTeam
from tests.quadriga.own_cache import use_own_cache

# Short horizons, so that fits are cheap; the linear team's low level has no height integrator.
OPTIONS: dict[str, Any] = {
    "team.robots": 2, "planner.N": 8, "planner.T_ini": 4, "controller.ki_z": 0.0,
    "identification.predictor": "ridge",
    "identification.order_per_robot": 9, "identification.max_radius": 10.0,
    "identification.max_peers_harm": 1000.0, "identification.gain_range": [0.1, 3.0],
    "identification.ridge": 1e-6, "reference.ramp": 0.0,
}  # fmt: skip


def config_of(**changes: Any) -> Config:
    """The configuration of the linear team; `a__b=value` sets the key a.b."""
    return load(None, OPTIONS | {name.replace("__", "."): v for name, v in changes.items()})


def arguments(**changes: Any) -> list[str]:
    """The same as options of the command line."""
    given = OPTIONS | {name.replace("__", "."): v for name, v in changes.items()}
    return [f"--set={name}={value}" for name, value in given.items()]


def dataset(samples: int = 700) -> Dataset:
    """Enough and exciting, with a little noise."""
    team = LinearTeam(2)
    episodes = [team.episode(samples, seed, trot=True, noise=0.01) for seed in range(3)]
    return Dataset(tuple(episodes[:2]), (episodes[2],), (5, 6))


def put_data(folder: Path, patch: pytest.MonkeyPatch, found: Dataset | None = None) -> None:
    """Make `folder` the cache, with the linear team's data in it."""
    use_own_cache(folder, patch)
    write_data(data_path(config_of()), found or dataset())
