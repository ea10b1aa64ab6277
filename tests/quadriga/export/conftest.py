"""A short run of closed-form motions with all kinds of messages, and some that cannot be read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quadriga.shared.messages import Event, Plan, Status
from tests.quadriga.conftest import run_config, write

SECONDS = 0.8
LEFT_OUT = {"team/r1/state": 1, "team/some/body/else": 1}
FALL = Event(700, 700_000_000, "fall", "r2", "tilt 1.10 rad", "fall")
STATUS = Status(
    750,
    750_000_000,
    "stopping",
    "peer-lost:r2",
    "kalman",
    {"plan.r2": 350.0, "a b": 2.0},
    {"qp_fallback": 3},
    np.array([0.5, 0.25]),
    np.zeros(0),
)
PLAN = Plan(
    760,
    760_000_000,
    19,
    np.arange(300.0).reshape(25, 12),
    np.arange(150.0).reshape(25, 6) / 7,
    "nominal:no data",
    {"r2": 11},
    1,
)


@pytest.fixture(scope="session")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    extra = [("team/sim/event", FALL), ("team/r1/status", STATUS), ("team/r1/plan", PLAN)]
    folder = tmp_path_factory.mktemp("export")
    foreign = ("team/some/body/else", FALL)
    write(
        folder,
        run_config(2, SECONDS),
        extra=[*extra, foreign],
        change=lambda key, m: b"bad" if (key, m.tick) == ("team/r1/state", 33) else m,
    )
    return folder / "run.mcap"
