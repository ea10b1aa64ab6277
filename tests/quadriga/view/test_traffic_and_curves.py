"""Rates by key, and the window of curves."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from quadriga.shared.bus.ring_buffer import Newest
from quadriga.shared.codec import encode
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Status
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


def test_what_nobody_listens_to_is_counted_by_who_answers_it() -> None:
    traffic = Traffic(10.0)
    traffic.note("r1/status", 0, -1, 10.0)
    traffic.note_told("r1/state", [], 10.0)
    unknown = KeyTraffic("r1/state", 0.0, None, None, told=True)
    assert traffic.report(10.5)[1] == unknown
    # Since when the agent has counted what its first status tells is not known.
    traffic.note_told("r1/state", [90], 10.5)
    assert traffic.report(10.75)[1] == KeyTraffic("r1/state", 0.0, None, 0.25, told=True)
    traffic.note_told("r1/state", [100, 100], 10.75)
    traffic.note_told("r1/state", [50], 11.0)
    traffic.note("r1/status", 3, 900, 11.0)
    status, state = traffic.report(11.5)
    assert status == KeyTraffic("r1/status", 4.0, 0, 0.5)
    assert state == KeyTraffic("r1/state", 500.0, None, 0.5, told=True)
    # A pause between two reports is not taken for a slower rate of what came before it.
    assert traffic.report(12.5)[1] == KeyTraffic("r1/state", 0.0, None, 1.5, told=True)
    traffic.note_told("r1/state", [200], 13.0)
    assert traffic.report(13.0)[1].per_s == 100.0


class StatusBus:
    """A bus on which one agent has said its statuses, and nobody anything else."""

    team = "team"

    def __init__(self) -> None:
        self.statuses: list[Any] = []
        self.keys: list[str] = []

    def say_status(self, tick: int, answered: int) -> None:
        nothing = np.zeros(0)
        status = Status(tick, 0, "walk", "", "kalman", {}, {}, nothing, np.full(answered, 80.0))
        payload = SimpleNamespace(to_bytes=lambda: encode(status))
        self.statuses.append(SimpleNamespace(payload=payload))

    def keep_newest(self, key: str, _most: int) -> Newest:
        self.keys.append(key)
        source = self.statuses if key == "team/r1/status" else []
        return Newest(lambda: source.pop(0) if source else None)


def test_a_live_view_knows_rates_of_states_and_commands_without_hearing_them() -> None:
    bus = StatusBus()
    feed = _Feed(cast(Any, bus), build_team_shape(Config()), 10.0)
    assert not any(key.endswith(("/state", "/command")) for key in bus.keys)
    bus.say_status(100, 100)
    feed.read(10.0)
    for tick in (200, 300):
        bus.say_status(tick, 100)
    feed.read(10.25)
    rows = {row.key: row for row in feed.traffic.report(10.25)}
    for name in ("state", "command"):
        assert rows[f"r1/{name}"] == KeyTraffic(f"r1/{name}", 800.0, None, 0.0, told=True)
        assert rows[f"r2/{name}"] == KeyTraffic(f"r2/{name}", 0.0, None, None, told=True)
    assert rows["r1/status"].behind_ms == 0
    assert feed.gatherer.snapshot().statuses["r1"].tick == 300


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
