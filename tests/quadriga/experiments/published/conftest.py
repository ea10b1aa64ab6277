"""Experiments of every kind, for the tests of what is published."""

from __future__ import annotations

import pytest

from quadriga.experiments.published.experiment import Experiment, Part, Published
from quadriga.experiments.sweep import parse_sweep
from tests.quadriga.experiments.published.made import experiment_of


@pytest.fixture
def experiments() -> list[Experiment]:
    """One with everything, one that sweeps, one that nobody has walked."""
    full = experiment_of(
        "steps",
        "ice",
        published=Published(
            (
                "trials",
                "success",
                "falls",
                "stops",
                "time-to-fall",
                "vx",
                "transport",
                "cost",
                "p50",
                "p99",
                "rmse-z",
            ),
            True,
            ("cost", "roll", "z"),
            ("success", "falls", "ratios"),
        ),
    )
    swept = Part("steps", ("steps",), parse_sweep("world.terrain_height=0.04,0.1"), "height [m]")
    sweeps = experiment_of(
        "steps",
        name="swept",
        parts=(swept,),
        requirements=(),
        published=Published(("success",), False, (), ("sweep",)),
    )
    return [full, sweeps, experiment_of("steps", name="later")]
