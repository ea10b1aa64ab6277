"""What a candidate's walks are worth: falls, when they fell, and errors against the start's."""

from __future__ import annotations

import math
from typing import Any

import pytest

from quadriga.experiments.trial.outcome import TrialOutcome
from quadriga.experiments.tuning.loss import by_world, loss
from tests.quadriga.experiments.rows import row

SECONDS = 10.0
ERRORS = ("z_over_stance_feet", "vx", "vy", "roll", "pitch", "wz")


def walk(seed: int, **changes: Any) -> TrialOutcome:
    return row(**{"seed": seed, "seconds": SECONDS, "error": 0.1, **changes})


def fall(seed: int, seconds: float) -> TrialOutcome:
    return walk(seed, fell=seconds, seconds=seconds)


def test_walks_like_those_of_the_start_cost_nothing() -> None:
    start = by_world([walk(0), walk(1)])
    assert loss(start, start, SECONDS) == 0.0


@pytest.mark.parametrize(("seconds", "lost"), [(10.0, 1.0), (5.0, 1.5), (0.0, 2.0)])
def test_an_earlier_fall_costs_more(seconds: float, lost: float) -> None:
    start = by_world([walk(0), walk(1)])
    found = loss(by_world([fall(0, seconds), walk(1)]), start, SECONDS)
    assert found == pytest.approx(lost / 2)


def test_errors_count_by_their_mean_log_ratio_where_both_walked_to_the_end() -> None:
    start = by_world([walk(0), fall(1, 2.0)])
    mine = by_world([walk(0, rmse_roll=0.2), walk(1, rmse_vy=5.0)])
    assert loss(mine, start, SECONDS) == pytest.approx(math.log(2.0) / len(ERRORS))


def test_a_candidate_that_is_refused_is_worse_than_one_that_falls_at_once() -> None:
    start = by_world([walk(0)])
    refused = by_world([walk(0, success=False, refused="best responses do not converge")])
    assert loss(refused, start, SECONDS) > loss(by_world([fall(0, 0.0)]), start, SECONDS)
