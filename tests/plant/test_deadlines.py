"""The account of the world in real time."""

from __future__ import annotations

import numpy as np

from quadriga.plant.deadlines import HELD, Deadlines
from quadriga.shared.codec import decode, encode
from quadriga.shared.messages import Status


def test_ages_of_commands_and_lateness_of_the_world_are_told() -> None:
    deadlines = Deadlines(("r1", "r2"))
    for tick in range(200):
        deadlines.note_age("r1", 0)
        deadlines.note_age("r2", 3 if tick % 4 == 0 else 0)
        deadlines.note_lateness(5e-3 if tick == 100 else 1e-4)
    deadlines.late["r2", HELD] += 2
    status = deadlines.status(200, overruns=1)
    assert decode(encode(status), Status).counters == {
        "overruns": 1,
        "ticks": 200,
        "r1.due": 200,
        "r2.due": 200,
        "r1.late": 0,
        "r2.late": 50,
        "r2.held": 2,
    }
    assert deadlines.describe_late() == "r1 0, r2 50, r2 held 2"
    assert status.ages_ms["r1.command.max"] == 0.0
    assert [status.ages_ms[f"r2.command.{q}"] for q in ("median", "p99", "max")] == [0.0, 3.0, 3.0]
    assert abs(status.ages_ms["jitter.median"] - 0.1) <= 0.02
    assert status.ages_ms["jitter.max"] == 5.0
    assert len(status.tick_us) == 200
    assert np.max(status.tick_us) == 5000.0
    assert len(deadlines.status(201, 1).tick_us) == 0  # each lateness is told once
