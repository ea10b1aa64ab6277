"""The first plan of each process counts in no figure of plan times."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from quadriga.recordings.summary import summarise
from quadriga.recordings.traces import plan_times
from quadriga.report.process_figures import list_times
from quadriga.report.run import read_run
from quadriga.shared.messages import Message, Status
from tests.quadriga.conftest import WriteRun, run_config


def status(tick: int, counters: Mapping[str, int], *planner_ms: float) -> Status:
    times = np.array(planner_ms, dtype=float)
    return Status(tick, 0, "walk", "", "kalman", {}, counters, times, np.zeros(0))


@pytest.mark.parametrize(
    ("statuses", "left"),
    [
        ([], []),
        ([status(0, {})], []),
        ([status(0, {}), status(100, {}, 9.0)], []),
        ([status(0, {}), status(100, {}, 9.0, 1.0), status(200, {"a": 1}, 2.0)], [1.0, 2.0]),
        # Its counters have begun anew: another process, whose first plan is left out, too.
        (
            [status(0, {"a": 2}, 9.0, 1.0), status(100, {"a": 1}), status(200, {"a": 1}, 8.0, 2.0)],
            [1.0, 2.0],
        ),
        ([status(0, {"a": 2}, 9.0, 1.0), status(100, {"b": 1}, 8.0, 2.0)], [1.0, 2.0]),
    ],
)
def test_the_first_time_of_each_process_is_left_out(
    statuses: list[Status], left: list[float]
) -> None:
    assert plan_times(statuses).tolist() == left


def test_a_slow_first_plan_is_counted_and_in_no_figure(write_run: WriteRun) -> None:
    def change(key: str, message: Message) -> Message:
        if not isinstance(message, Status) or message.tick != 400:
            return message
        return status(400, message.counters, 70.0, 0.3, 1.0)

    folder: Path = write_run(run_config(2, 1.0), change=change)
    summary = summarise(folder)
    assert summary["planner_solves"] == 2 * 3 * 6
    assert summary["planner_ms_p99"] == pytest.approx(1.0)
    times = {row[0]: row[1:5] for row in list_times(read_run(folder / "run.mcap"))}
    assert times["r1"] == ("18", "0.30", "1.00", "1.00")
