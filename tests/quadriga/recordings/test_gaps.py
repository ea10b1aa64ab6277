"""What a recording lacks is counted against what its team should have sent."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.recordings.gaps import missing_ticks, repeated_ticks
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config


def configured(**keys: object) -> Config:
    given = {name.replace("__", "."): value for name, value in keys.items()}
    return load(None, {"team.robots": 1, "world.seconds": 1.0, "gait.stand_ms": 100, **given})


def whole(truth_ms: int) -> dict[str, np.ndarray]:
    """Ticks by key of a walk of 1 s."""
    every, sampled = np.arange(1000), np.arange(10, 1000, 10)
    return {
        "team/r1/state": every,
        "team/r1/command": every,
        "team/r1/measurement": sampled,
        "team/r1/plan": np.arange(120, 1000, 40),
        "team/sim/truth": np.arange(0, 1000, truth_ms),
    }


@pytest.mark.parametrize(("kind", "truth_ms"), [("kalman", 10), ("truth", 1)])
def test_each_topic_is_expected_once_a_period(kind: str, truth_ms: int) -> None:
    config, ticks = configured(estimator__kind=kind), whole(truth_ms)
    assert set(missing_ticks(config, ticks).values()) == {0}
    for key, found in ticks.items():
        missing = missing_ticks(config, ticks | {key: np.delete(found, [5, 6])})
        assert {k: count for k, count in missing.items() if count} == {key: 2}


def test_truth_is_expected_of_one_simulated_world_alone() -> None:
    ticks = whole(10)
    del ticks["team/sim/truth"]
    assert missing_ticks(configured(), ticks)["team/sim/truth"] == 99
    for other in ({"team__plants": "each"}, {"team__plant": "puppet"}):
        assert "team/sim/truth" not in missing_ticks(configured(**other), ticks)


def test_a_robot_of_which_nothing_came_lacks_everything() -> None:
    missing = missing_ticks(configured(team__robots=2), whole(10))
    assert missing["team/r2/state"] == missing["team/r2/command"] == 999
    assert missing["team/r2/measurement"] == 89  # from the end of the initial stand on
    assert missing["team/r1/state"] == 0


def test_a_tick_that_came_twice_has_a_second_publisher() -> None:
    ticks = whole(10)
    assert repeated_ticks(ticks) == 0
    assert repeated_ticks(ticks | {"team/r1/command": np.array([1, 2, 2, 2, 3])}) == 2
