"""Periods and ages that the configuration says."""

from __future__ import annotations

from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.config.timing import max_ages, periods
from quadriga.shared.topics import CONFIGURED, TABLE


def test_periods_follow_the_configuration() -> None:
    assert (periods(Config())["plan"], periods(Config())["sim/truth"]) == (40, 10)
    keys = {"planner.applied": 2, "estimator.kind": "truth", "world.mode": "realtime"}
    other = periods(load(None, keys))
    assert (other["plan"], other["sim/truth"], other["status"]) == (20, 1, 0)
    bridged = {"team.plant": "robots", "team.plant_per_robot": True, "world.mode": "realtime"}
    assert periods(load(None, bridged))["state"] == 10


def test_what_the_table_says_holds_whatever_is_configured() -> None:
    for config in (Config(), load(None, {"planner.preset": "fast", "world.mode": "realtime"})):
        for topic in TABLE:
            assert topic.period_ms in (CONFIGURED, periods(config)[topic.name])
            assert topic.max_age_ms in (CONFIGURED, max_ages(config)[topic.name])


def test_a_plan_is_used_until_who_made_it_is_given_up() -> None:
    assert max_ages(Config())["plan"] == 360
    assert max_ages(load(None, {"planner.kind": "centralised"}))["plan"] == 368
