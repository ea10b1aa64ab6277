"""A trial over the bus and the same trial in one process have the same figures."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from agents.planner.store import load
from quadriga.identify import fit
from quadriga.trial import Figures, figures
from quadriga.trial_walk import over_the_bus, roll_out
from shared.errors import ConfigError
from tests.quadriga.linear_data import config_of, dataset


def untimed(found: Figures) -> Figures:
    """Without what depends on the machine, and what only the simulator knows."""
    return replace(found, planner_ms_median=None, planner_ms_p99=None, solves=0, work=None,
                   cost_of_transport=None)  # fmt: skip


def test_over_the_bus_a_trial_comes_to_the_same(tmp_path: Path) -> None:
    """Two robots that plan with each other's plans, each a process of its own."""
    config = config_of(world__seconds=1.4)
    path, run_dir = tmp_path / "predictor.npz", tmp_path / "run"
    sha256, _ = fit(config, dataset(), path, Console(stderr=True))
    alone = figures(roll_out(config, load(path, config)[0], None))
    assert alone.cost is not None
    assert alone.plans
    assert alone.work
    together = figures(over_the_bus(config, run_dir, path, sha256))
    assert untimed(together) == untimed(alone)
    with pytest.raises(ConfigError, match="a folder with a recording"):
        over_the_bus(config, run_dir, path, sha256)
