import math
from collections import Counter
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared.errors import ConfigError
from quadriga.shared.robot.conventions import robot_names
from quadriga.sim_server.world.pushes import Push, parse_pushes, push_series
from tests.sim_server.standing import configured

NAMES = robot_names(3)


def test_pushes_are_parsed() -> None:
    first, second = parse_pushes("r2:80:90:1:0.2, all:-0:0:0:0.001", NAMES)
    assert (first.robots, first.force, first.start, first.stop) == ((1,), 80.0, 1000, 1200)
    assert first.direction == pytest.approx(math.pi / 2)
    assert second.robots == (0, 1, 2)
    assert parse_pushes("", NAMES) == ()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("r1:80:0:1", "robot:force"),
        ("r1:80:0:1:0.2:3", "robot:force"),
        ("r9:80:0:1:0.2", "robot 'r9'"),
        ("r1:strong:0:1:0.2", "robot:force"),
        ("r1:-5:0:1:0.2", "force -5"),
        ("r1:nan:0:1:0.2", "force nan"),
        ("r1:1e9:0:1:0.2", r"force 1e\+09"),
        ("r1:80:inf:1:0.2", "direction inf"),
        ("r1:80:0:-1:0.2", "start -1"),
        ("r1:80:0:1:0", "duration 0"),
        ("r1:80:0:1:0.2,", "robot:force"),
        (",", "robot:force"),
    ],
)
def test_a_wrong_push_names_the_key_and_what_is_wrong(text: str, message: str) -> None:
    with pytest.raises(ConfigError, match=rf"^world\.push: .*{message}"):
        parse_pushes(text, NAMES)


@given(st.text(alphabet="rall0123:.,- e", max_size=30))
def test_any_text_is_parsed_or_refused(text: str) -> None:
    try:
        pushes = parse_pushes(text, NAMES)
    except ConfigError:
        return  # anything else fails the test
    assert len(pushes) == (text.count(",") + 1 if text else 0)


def series(seed: int = 0, **world: Any) -> tuple[Push, ...]:
    config = configured(3, **{"push_force": 80.0, "seconds": 20.0} | world)
    return push_series(config, np.random.default_rng(seed))


def test_a_series_pushes_the_robots_in_turn_sideways() -> None:
    pushes = series(push_every=2.0, push_duration=0.1)
    assert len(pushes) == 9
    assert Counter(push.robots for push in pushes) == {(0,): 3, (1,): 3, (2,): 3}
    assert len({push.robots for push in pushes[:3]}) == 3
    assert {push.force for push in pushes} == {80.0}
    assert {abs(push.direction) for push in pushes} == {math.pi / 2.0}
    assert {push.stop - push.start for push in pushes} == {100}
    for k, push in enumerate(pushes, start=1):
        assert 2000 * k <= push.start < 2000 * k + 400  # within one period of the gait


def test_another_seed_pushes_others_at_other_times_from_other_sides() -> None:
    many = [series(seed) for seed in range(40)]
    assert series(3) == series(3)
    assert len({tuple((p.robots, p.direction, p.start) for p in pushes) for pushes in many}) == 40
    assert {pushes[0].robots for pushes in many} == {(0,), (1,), (2,)}
    assert len({pushes[0].direction for pushes in many}) == 2
    assert len({pushes[0].start for pushes in many}) > 30


def test_the_force_sweeps_a_series_without_moving_it() -> None:
    weak, strong = series(push_force=80.0), series(push_force=240.0)
    assert [(p.robots, p.direction, p.start) for p in weak] == [
        (p.robots, p.direction, p.start) for p in strong
    ]
    assert {push.force for push in strong} == {240.0}
    spread = [p.force for seed in range(20) for p in series(seed, push_spread=0.2)]
    assert 64.0 <= min(spread) < 68.0
    assert 92.0 < max(spread) <= 96.0
    assert series(push_force=0.0) == ()
