"""What a recording lacks is counted against what its team should have sent."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.agents.predictor.gates import load_checked
from quadriga.recordings.gaps import missing_ticks, repeated_ticks
from quadriga.shared.codec import decode
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Measurement, Plan, Status
from quadriga.shared.recording.reader import Recording
from tests.golden import scenario
from tests.golden.rerun import rerun


def configured(**keys: object) -> Config:
    given = {name.replace("__", "."): value for name, value in keys.items()}
    return load(None, {"team.robots": 1, "world.duration": 1.0, "gait.stand_ms": 100, **given})


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
    assert "team/sim/truth" not in missing_ticks(configured(team__plant="puppet"), ticks)


def test_a_robot_of_which_nothing_came_lacks_everything() -> None:
    missing = missing_ticks(configured(team__robots=2), whole(10))
    assert missing["team/r2/state"] == missing["team/r2/command"] == 999
    assert missing["team/r2/measurement"] == 89  # from the end of the initial stand on
    assert missing["team/r1/state"] == 0


def test_of_ticks_that_an_agent_passed_over_no_command_is_expected() -> None:
    ticks = whole(10)
    ticks["team/r1/command"] = np.delete(np.arange(1000), [0, 7, 8, 9, 500, 900])
    spans = [(900, 902), (0, 1), (7, 10), (-5, -1), (7, 8)]
    key = "team/r1/command"
    assert missing_ticks(configured(), ticks)[key] == 6
    assert missing_ticks(configured(), ticks, passed_over={"r2": spans})[key] == 6
    assert missing_ticks(configured(), ticks, passed_over={"r1": spans})[key] == 1
    assert missing_ticks(configured(), ticks, passed_over={"r1": [(0, 1000)]})[key] == 0
    del ticks["team/r1/command"]
    assert missing_ticks(configured(), ticks, passed_over={"r1": [(0, 5)]})[key] == 994


def says(tick: int, mode: str) -> Status:
    return Status(tick, 0, mode, "", "", {}, {}, np.zeros(0), np.zeros(0))


def test_nothing_is_expected_that_a_robot_says_it_does_not_make() -> None:
    """It walks from 100, stands from 300 to 500, and stands up from 700 to 900 ms."""
    modes = {0: "stand", 100: "walk", 300: "stand", 500: "walk", 700: "standing-up", 900: "walk"}
    statuses = {"r1": [says(tick, mode) for tick, mode in modes.items()]}
    ticks = whole(10)
    plans, measured = ticks["team/r1/plan"], ticks["team/r1/measurement"]
    walks = (plans < 300) | ((plans >= 540) & (plans < 700)) | (plans >= 920)
    ticks["team/r1/plan"] = plans[walks]
    ticks["team/r1/measurement"] = measured[(measured < 700) | (measured >= 910)]
    assert sum(missing_ticks(configured(), ticks, statuses).values()) == 0
    assert missing_ticks(configured(), ticks)["team/r1/plan"] == (~walks).sum()
    ticks["team/r1/plan"] = np.setdiff1d(ticks["team/r1/plan"], [200, 600])
    assert missing_ticks(configured(), ticks, statuses)["team/r1/plan"] == 2


def test_a_robot_that_only_stands_lacks_no_plans() -> None:
    ticks = whole(10)
    del ticks["team/r1/plan"]
    stands = {"r1": [says(tick, "stand") for tick in range(0, 1000, 100)]}
    assert missing_ticks(configured(), ticks, stands)["team/r1/plan"] == 0
    assert missing_ticks(configured(), ticks)["team/r1/plan"] == 22


def test_a_tick_that_came_twice_has_a_second_publisher() -> None:
    ticks = whole(10)
    assert repeated_ticks(ticks) == 0
    assert repeated_ticks(ticks | {"team/r1/command": np.array([1, 2, 2, 2, 3])}) == 2


def test_a_controller_of_ones_own_measures_nothing_for_others() -> None:
    ticks = {key: found for key, found in whole(10).items() if key.endswith(("command", "state"))}
    ticks["team/sim/truth"] = whole(10)["team/sim/truth"]
    missing = missing_ticks(configured(team__agent_command="walk"), ticks)
    assert missing == {"team/sim/truth": 0, "team/r1/state": 0, "team/r1/command": 0}


@pytest.mark.parametrize(
    "passed",
    [
        [(200, 201)],
        [(201, 209)],
        [(200, 210)],
        [(199, 210)],
        [(195, 225), (301, 310)],
        [(240, 241)],
    ],
)
def test_what_an_agent_cannot_make_of_the_ticks_it_passed_over_is_not_lost(
    passed: list[tuple[int, int]],
) -> None:
    """The golden walk, heard by an agent that passes over ticks."""
    config, own = scenario.config(), "team/r1/"
    entries = list(Recording(scenario.RECORDING).entries())
    never = {tick for span in passed for tick in range(*span)}
    heard = [e for e in entries if e.key != f"{own}state" or e.tick not in never]
    sent = rerun(heard, config, "r1", load_checked(scenario.PREDICTOR, config)[0])
    made = {f"{own}measurement": Measurement, f"{own}plan": Plan}
    ticks = {
        key: np.array([decode(payload, kind).tick for name, payload in sent if name == key])
        for key, kind in made.items()
    }
    ticks[f"{own}state"] = np.arange(600)
    missing = missing_ticks(config, ticks, passed_over={"r1": passed})
    assert [missing[key] for key in made] == [0, 0]
    for key in made:
        for place in range(1, len(ticks[key]) - 1):
            less = ticks | {key: np.delete(ticks[key], place)}
            assert missing_ticks(config, less, passed_over={"r1": passed})[key] == 1
