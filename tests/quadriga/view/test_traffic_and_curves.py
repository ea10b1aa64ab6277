"""Rates by key, and the window of curves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quadriga.shared.recording.reader import Recording
from quadriga.view.curves import SAMPLES, CurveWindow, axis_range, ticks_before
from quadriga.view.readings import read_outputs
from quadriga.view.recorded import RecordedRun
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
