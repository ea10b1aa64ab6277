"""Status is due at 10 Hz and on every change of mode."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quadriga.agents.agent import Outputs
from quadriga.agents.telemetry import Telemetry
from quadriga.shared.messages import Command

ZERO = np.zeros(12)


def outputs(mode: str, planner_ns: int | None = None) -> Outputs:
    command = Command(0, 0, ZERO, ZERO, ZERO, ZERO, ZERO)
    return Outputs(command, None, None, mode, "", {"qp_failed": 1}, {"reference": 3.0}, planner_ns)


def test_status_at_10_hz_and_on_change_of_mode() -> None:
    telemetry = Telemetry("kalman")
    modes = {tick: "stand" if tick < 250 else "walk" for tick in range(500)}
    sent = []
    for tick, mode in modes.items():
        planned = 2_000_000 if tick % 40 == 0 else None
        telemetry.note_step(outputs(mode, planned), tick_ns=500_000)
        status = telemetry.status(tick, outputs(mode), {"dropped_state": 2})
        if status is not None:
            sent.append(status)
    assert [status.tick for status in sent] == [0, 100, 200, 250, 300, 400]
    assert [status.mode for status in sent] == ["stand"] * 3 + ["walk"] * 3
    assert sum(len(status.tick_us) for status in sent) == 401
    assert sum(len(status.planner_ms) for status in sent) == 11
    assert {*sent[0].planner_ms, *sent[0].tick_us} == {2.0, 500.0}
    assert sent[-1].counters == {"qp_failed": 1, "dropped_state": 2}
    assert sent[-1].ages_ms == {"reference": 3.0}


def test_an_age_told_between_two_status_messages_is_not_lost() -> None:
    telemetry = Telemetry("kalman")
    planned = replace(outputs("walk"), ages_ms={"plan.r1": 40.0})
    telemetry.note_step(planned, 0)
    telemetry.note_step(outputs("walk"), 0)
    status = telemetry.status(0, outputs("walk"), {})
    assert status is not None
    assert status.ages_ms == {"plan.r1": 40.0, "reference": 3.0}


def test_a_walk_tells_no_age_of_a_plan_of_the_walk_before() -> None:
    telemetry = Telemetry("kalman")
    lost = replace(outputs("stop"), ages_ms={"plan.r1": 400.0, "reference": 3.0})
    telemetry.note_step(lost, 0)
    told = telemetry.status(0, lost, {})
    assert told is not None
    assert told.ages_ms["plan.r1"] == 400.0
    telemetry.note_step(outputs("stand"), 0)
    telemetry.note_step(outputs("walk"), 0)
    status = telemetry.status(100, outputs("walk"), {})
    assert status is not None
    assert status.ages_ms == {"reference": 3.0}


def test_after_a_gap_in_the_ticks_the_next_is_due_on_the_grid() -> None:
    telemetry = Telemetry("truth")
    due = [tick for tick in (0, 99, 257, 299, 300) if telemetry.status(tick, outputs("walk"), {})]
    assert due == [0, 257, 300]


def test_in_real_time_missed_deadlines_and_jitter_are_told() -> None:
    telemetry = Telemetry("kalman", paced=True)
    for tick in range(100):
        late_ns = 700_000 if tick == 50 else 0
        telemetry.note_state(tick, 1_000_000 * tick + late_ns)
        telemetry.note_step(outputs("walk"), 1_500_000 if tick % 10 == 0 else 300_000)
    status = telemetry.status(100, outputs("walk"), {})
    assert status is not None
    assert status.counters["deadlines_missed"] == 10
    assert status.ages_ms["jitter.median"] == 0.0
    assert status.ages_ms["jitter.max"] == pytest.approx(0.7)


def test_a_state_passed_over_is_no_jitter() -> None:
    telemetry = Telemetry("kalman", paced=True)
    for tick in (0, 1, 4, 5):
        telemetry.note_state(tick, 1_000_000 * tick)
    status = telemetry.status(5, outputs("walk"), {})
    assert status is not None
    assert status.ages_ms["jitter.max"] == pytest.approx(0.0, abs=1e-9)
