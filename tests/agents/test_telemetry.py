"""Status is due at 10 Hz and on every change of mode; what it tells of ages and times."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quadriga.agents.agent import Outputs
from quadriga.agents.telemetry import Telemetry
from quadriga.shared.messages import Command, Status


def outputs(mode: str, planner_ns: int | None = None, **ages_ms: float) -> Outputs:
    command, ages = Command(0, 0, *np.zeros((5, 12))), {"reference": 3.0, **ages_ms}
    return Outputs(command, None, None, mode, "", {"qp_failed": 1}, ages, planner_ns)


def status_of(telemetry: Telemetry, tick: int, out: Outputs) -> Status:
    status = telemetry.status(tick, out, {})
    assert status is not None
    return status


def test_status_at_10_hz_and_on_change_of_mode() -> None:
    telemetry, sent = Telemetry("kalman"), list[Status]()
    for tick in range(500):
        mode = "stand" if tick < 250 else "walk"
        planned = 2_000_000 if tick % 40 == 0 else None
        telemetry.note_answer(500_000)
        telemetry.note_step(outputs(mode, planned))
        status = telemetry.status(tick, outputs(mode), {"dropped_state": 2})
        sent += [] if status is None else [status]
    assert [status.tick for status in sent] == [0, 100, 200, 250, 300, 400]
    assert [status.mode for status in sent] == ["stand"] * 3 + ["walk"] * 3
    assert sum(len(status.tick_us) for status in sent) == 401
    assert sum(len(status.planner_ms) for status in sent) == 11
    assert {*sent[0].planner_ms, *sent[0].tick_us} == {2.0, 500.0}
    assert sent[-1].counters == {"qp_failed": 1, "dropped_state": 2}
    assert sent[-1].ages_ms == {"reference": 3.0}
    gaps = Telemetry("truth")
    due = [tick for tick in (0, 99, 257, 299, 300) if gaps.status(tick, outputs("walk"), {})]
    assert due == [0, 257, 300], "after a gap in the ticks the next is due on the grid"


def test_an_age_told_between_two_status_messages_is_not_lost_before_the_walk_is_over() -> None:
    telemetry, walks, age = Telemetry("kalman"), outputs("walk"), {"plan.r1": 400.0}
    telemetry.note_step(replace(walks, ages_ms=age))
    telemetry.note_step(walks)
    assert status_of(telemetry, 0, walks).ages_ms == {"plan.r1": 400.0, "reference": 3.0}
    telemetry.note_step(replace(outputs("stop"), ages_ms=age))
    assert status_of(telemetry, 100, outputs("stop")).ages_ms["plan.r1"] == 400.0
    telemetry.note_step(outputs("stand"))
    telemetry.note_step(walks)
    assert status_of(telemetry, 200, walks).ages_ms == {"reference": 3.0}


@pytest.mark.parametrize(("ticks", "late"), [(range(100), 50), ((0, 1, 4, 5), None)])
def test_in_real_time_jitter_is_told(ticks: tuple[int, ...], late: int | None) -> None:
    """A state that was passed over is no jitter."""
    telemetry = Telemetry("kalman", paced=True)
    for tick in ticks:
        telemetry.note_state(tick, 1_000_000 * tick + (700_000 if tick == late else 0))
    status = status_of(telemetry, 100, outputs("walk"))
    assert status.ages_ms["jitter.median"] == 0.0
    most = 0.0 if late is None else 0.7
    assert status.ages_ms["jitter.max"] == pytest.approx(most, abs=1e-9 if late is None else None)
