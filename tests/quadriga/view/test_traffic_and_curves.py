"""Rates by key, and the window of curves."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from quadriga.shared.codec import encode
from quadriga.shared.config.sections import Config
from quadriga.shared.link.packets import COMMAND_SIZE, STATE_SIZE
from quadriga.shared.link.ticks import TickBatch
from quadriga.shared.recording.reader import Recording
from quadriga.view.curves import SAMPLES, CurveWindow, axis_range, ticks_before
from quadriga.view.live import _Feed
from quadriga.view.readings import read_outputs
from quadriga.view.recorded import RecordedRun
from quadriga.view.team_shape import build_team_shape
from quadriga.view.traffic import KeyTraffic, Traffic
from tests.quadriga.conftest import ESTIMATOR_ERROR, outputs


def test_rates_are_of_the_time_since_the_last_report() -> None:
    traffic = Traffic(10.0)
    traffic.note("r1/state", 0, -1, 10.0)
    assert traffic.report(10.5) == (KeyTraffic("r1/state", 0.0, None, None),)
    traffic.note("r1/state", 500, 730, 11.0)
    traffic.note("r1/plan", 10, 700, 10.75)
    state, plan = traffic.report(11.0)
    assert state == KeyTraffic("r1/state", 1000.0, 0, 0.0)
    assert plan == KeyTraffic("r1/plan", 20.0, 30, 0.25)
    assert [row.per_s for row in traffic.report(12.0)] == [0.0, 0.0]


class TicksBus:
    """A bus on which a plant says batches of ticks, and nobody anything else."""

    team = "team"

    def __init__(self) -> None:
        self.said: list[tuple[int, str, bytes]] = []
        self.batch = TickBatch(("r1", "r2"))

    def say(self, ticks: range) -> None:
        """States of r1 and commands that it gave, of each other tick."""
        for tick in ticks:
            self.batch.add_state("r1", tick, np.zeros(STATE_SIZE), 0)
            if tick % 2:
                self.batch.add_command("r1", tick, np.zeros(COMMAND_SIZE), 0)
        message = self.batch.take(ticks[-1])
        assert message is not None
        self.said.append((0, "team/sim/ticks", encode(message)))

    def collect(self, *keys: str) -> Callable[[], list[tuple[int, str, bytes]]]:
        assert "team/*/ticks" in keys
        return lambda: [self.said.pop(0) for _ in range(len(self.said))]


def test_a_live_view_tells_states_and_commands_out_of_batches_of_ticks() -> None:
    bus = TicksBus()
    feed = _Feed(cast(Any, bus), build_team_shape(Config()), 10.0)
    assert not feed.read(10.0)
    for begin in (100, 110):
        bus.say(range(begin, begin + 10))
    assert feed.read(10.25)
    rows = {row.key: row for row in feed.traffic.report(10.25)}
    assert rows["r1/state"] == KeyTraffic("r1/state", 80.0, 0, 0.0)
    assert rows["r1/command"] == KeyTraffic("r1/command", 40.0, 0, 0.0)
    for key in ("r2/state", "r2/command", "r1/status"):
        assert rows[key] == KeyTraffic(key, 0.0, None, None)
    assert feed.gatherer.snapshot().states["r1"].tick == 119


def test_curves_hold_the_last_seconds(known_run: Path) -> None:
    run = RecordedRun(Recording(known_run / "run.mcap"))
    curves = CurveWindow(2)
    for tick in range(3000, 3501, 10):
        curves.add(tick, read_outputs(run.shape, run.snapshot(tick)))
    assert curves.seconds[-11:] == pytest.approx(np.arange(3.0, 3.51, 0.05))
    seconds, measured, planned, true, asked = curves.of_robot(1, 3)
    expected = [outputs(tick, 1)[3] for tick in range(3000, 3501, 50)]
    assert true[-11:] == pytest.approx(expected, abs=1e-9)
    assert measured[-11:] == pytest.approx(np.array(expected) + ESTIMATOR_ERROR[3])
    assert np.isnan(true[:-11]).all()
    assert len(seconds) == SAMPLES
    assert (planned[-11:] != 0.0).all()
    assert asked[-1] == 0.0
    assert len(curves.of_all(1)) == 4


def test_curves_begin_anew_where_the_time_jumps(known_run: Path) -> None:
    run = RecordedRun(Recording(known_run / "run.mcap"))
    curves = CurveWindow(2)
    for tick in (1000, 1050, 3000, 2000):
        assert curves.follows(tick) == (tick == 1050)
        curves.add(tick, read_outputs(run.shape, run.snapshot(tick)))
    assert np.isfinite(curves.values[:, 0, 0, 0]).sum() == 1
    assert len(ticks_before(2000)) == SAMPLES + 1


def test_axes_end_at_multiples_and_ignore_what_is_not_known() -> None:
    nothing = np.full(3, np.nan)
    assert axis_range([np.array([0.1, 0.3]), nothing], 0.25) == (0.0, 0.5)
    assert axis_range([np.array([-0.1]), np.array([0.5])], 0.25) == (-0.25, 0.5)
    assert axis_range([np.zeros(2)], 5.0) == (0.0, 5.0)
    assert axis_range([nothing], 5.0) == (0.0, 5.0)
