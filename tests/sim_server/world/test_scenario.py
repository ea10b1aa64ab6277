"""Loads, pushes and weak motors: their grammar, what is drawn of them, and their events."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared.errors import ConfigError
from quadriga.shared.robots.conventions import JOINT_NAMES, robot_names
from quadriga.sim_server.world.scenario import (
    Push,
    Scenario,
    WeakMotor,
    build_loads,
    build_scenario,
    parse_pushes,
    push_series,
    weak_motors,
)
from quadriga.sim_server.world.team_model import build_team_model
from tests.sim_server.standing import configured

NAMES = robot_names(3)


def built(robots: int, **world: Any) -> Scenario:
    config = configured(robots, **world)
    return build_scenario(config, build_loads(config))


def test_pushes_add_up_and_end_and_are_announced_with_the_rest() -> None:
    text = "all:10:0:1:1, r2:20:90:1.5:1"
    scenario = built(3, push=text, payload=9.0, payload_on="r2", terrain="boxes")
    along, left, none = np.array([10.0, 0.0, 0.0]), np.array([0.0, 20.0, 0.0]), np.zeros(3)
    expected = {
        1000: [along] * 3,
        1500: [along, along + left, along],
        2000: [none, left, none],
        2500: [none] * 3,
    }
    assert scenario.forces.keys() == expected.keys()
    for tick, forces in expected.items():
        np.testing.assert_allclose(scenario.forces[tick], forces, atol=1e-12)
    events = scenario.events
    assert [(event.tick, event.kind, event.robot) for event in events] == [
        (0, "start", ""),
        (0, "terrain", ""),
        (0, "payload", "r2"),
        (1000, "push", "r1"),
        (1000, "push", "r2"),
        (1000, "push", "r3"),
        (1500, "push", "r2"),
    ]
    assert events[2].detail == "9 kg"
    assert events[-1].detail == "20 N towards 90 deg for 1 s"
    assert events[-1].stamp_ns == 1_500_000_000


def test_a_motor_is_weak_from_its_tick_on_and_gives_what_is_announced() -> None:
    scenario = built(2, motor_strength="r2:FR_hip:2:0.5, r1:FL_hip:1:0.5")
    assert scenario.strength.keys() == {1000, 2000}
    assert scenario.strength[1000][0, 0] == scenario.strength[2000][1, 3] == 0.5
    assert scenario.strength[1000].sum() == 23.5
    assert scenario.strength[2000].sum() == 23.0
    details = [event.detail for event in scenario.events if event.kind == "fault"]
    assert details == ["FR_hip gives 50 % of its torque", "FL_hip gives 50 % of its torque"]


@pytest.mark.parametrize(
    ("on", "masses"),
    [
        ("team", [3.0, 3.0, 3.0]),
        ("r2", [0.0, 9.0, 0.0]),
        ("r2, r3", [0.0, 4.5, 4.5]),
        ("r1:2,r3", [6.0, 0.0, 3.0]),
    ],
)
def test_a_load_is_carried_by_all_or_by_some_with_shares_of_their_own(
    on: str, masses: list[float]
) -> None:
    loads = build_loads(configured(3, payload=9.0, payload_on=on))
    assert [load.mass for load in loads] == masses


def test_a_load_lies_somewhere_else_with_another_seed_whoever_else_carries_something() -> None:
    def offsets(robots: int, seed: int, on: str = "team") -> list[tuple[float, float]]:
        keys = {"payload": 1.0, "payload_scatter": 0.05, "seed": seed, "payload_on": on}
        return [load.offset for load in build_loads(configured(robots, **keys))]  # type: ignore[arg-type]

    places = np.array([offsets(2, seed) for seed in range(50)])
    assert np.abs(places).max() <= 0.05
    assert places.std(axis=0).min() > 0.02
    assert not np.allclose(places[:, 0], places[:, 1])
    assert offsets(2, 4, "r2")[1] == offsets(5, 4)[1]
    assert build_loads(configured(2, payload=1.0, seed=3))[0].offset == (0.0, 0.0)


def test_the_world_has_the_load_where_it_is_said_to_be() -> None:
    config = configured(2, payload=9.0, payload_on="r2", payload_scatter=0.1, seed=3)
    model, load = build_team_model(config).model, build_loads(config)[1]
    assert model.body("r2/payload").mass == pytest.approx([9.0])
    assert 0.06 <= model.body("r2/payload").pos[2] <= 0.12
    np.testing.assert_allclose(model.body("r2/payload").pos[:2], load.offset)
    x, y = load.offset
    assert load.detail == f"9 kg, {1000 * x:+.0f} mm ahead, {1000 * y:+.0f} mm left"


def test_pushes_are_parsed() -> None:
    first, second = parse_pushes("r2:80:90:1:0.2, all:-0:0:0:0.001", NAMES)
    assert (first.robots, first.force, first.start, first.stop) == ((1,), 80.0, 1000, 1200)
    assert first.direction == pytest.approx(math.pi / 2)
    assert second.robots == (0, 1, 2)
    assert parse_pushes("", NAMES) == ()


@pytest.mark.parametrize(
    ("key", "text", "message"),
    [
        ("push", "r1:80:0:1", "robot:force"),
        ("push", "r1:80:0:1:0.2:3", "robot:force"),
        ("push", "r9:80:0:1:0.2", "robot 'r9'"),
        ("push", "r1:strong:0:1:0.2", "force 'strong'"),
        ("push", "r1:nan:0:1:0.2", "force 'nan'"),
        ("push", "r1:1e9:0:1:0.2", "force '1e9'"),
        ("push", "r1:80:inf:1:0.2", "direction 'inf'"),
        ("push", "r1:80:0:-1:0.2", "start '-1'"),
        ("push", "r1:80:0:1:0", "duration '0'"),
        ("push", "r1:80:0:1:0.2,", "robot:force"),
        ("motor_strength", "r1:calf", "robot:joint:start"),
        ("motor_strength", "r4:calf:0", "robot 'r4'"),
        ("motor_strength", "r1:knee:0", "joint 'knee'"),
        ("motor_strength", "r1:calf:soon", "start 'soon'"),
        ("motor_strength", "r1:calf:0,", "robot:joint:start"),
        ("motor_strength", "r1:calf:0:0.5:1", "robot:joint:start"),
        ("motor_strength", "r1:calf:0:1.5", "share '1.5'"),
    ],
)
def test_a_wrong_text_names_the_key_and_what_is_wrong(key: str, text: str, message: str) -> None:
    with pytest.raises(ConfigError, match=rf"^world\.{key}: .*{message}"):
        built(3, **{key: text})


@given(st.text(alphabet="rall0123:.,- e", max_size=30))
def test_any_text_is_parsed_or_refused(text: str) -> None:
    try:
        pushes = parse_pushes(text, NAMES)
    except ConfigError:
        return  # anything else fails the test
    assert len(pushes) == (text.count(",") + 1 if text else 0)


def series(seed: int = 0, **world: Any) -> tuple[Push, ...]:
    config = configured(3, **{"push_force": 80.0, "duration": 20.0} | world)
    return push_series(config, np.random.default_rng(seed))


def test_a_series_pushes_the_robots_in_turn_sideways_as_the_seed_decides() -> None:
    pushes = series(push_every=2.0, push_duration=0.1)
    assert Counter(push.robots for push in pushes) == {(0,): 3, (1,): 3, (2,): 3}
    assert len({push.robots for push in pushes[:3]}) == 3
    assert {push.force for push in pushes} == {80.0}
    assert {abs(push.direction) for push in pushes} == {math.pi / 2.0}
    assert {push.stop - push.start for push in pushes} == {100}
    for k, push in enumerate(pushes, start=1):
        assert 2000 * k <= push.start < 2000 * k + 400  # within one period of the gait
    many = [series(seed) for seed in range(40)]
    assert series(3) == series(3)
    assert {pushes[0].robots for pushes in many} == {(0,), (1,), (2,)}
    assert len({pushes[0].direction for pushes in many}) == 2
    assert len({pushes[0].start for pushes in many}) > 30


def test_the_force_sweeps_a_series_without_moving_it() -> None:
    strong = series(push_force=240.0)
    assert [push._replace(force=80.0) for push in strong] == list(series(push_force=80.0))
    assert {push.force for push in strong} == {240.0}
    spread = [p.force for seed in range(20) for p in series(seed, push_spread=0.2)]
    assert 64.0 <= min(spread) < 68.0
    assert 92.0 < max(spread) <= 96.0
    assert series(push_force=0.0) == ()


def weak(text: str, seed: int = 0) -> tuple[WeakMotor, ...]:
    return weak_motors(configured(3, motor_strength=text), np.random.default_rng(seed))


def test_motors_are_named_by_robot_and_joint() -> None:
    first, second = weak("r2:RL_thigh:1.5, r3:FL_hip:0:0.25")
    assert (first.robot, JOINT_NAMES[first.joint], first.start) == (1, "RL_thigh_joint", 1500)
    assert (second.robot, JOINT_NAMES[second.joint], second.start) == (2, "FL_hip_joint", 0)
    assert (first.share, second.share) == (0.6, 0.25)
    assert weak("") == ()


@pytest.mark.parametrize(
    ("joint", "among"),
    [
        ("calf", {"FL_calf_joint", "FR_calf_joint", "RL_calf_joint", "RR_calf_joint"}),
        ("RR", {"RR_hip_joint", "RR_thigh_joint", "RR_calf_joint"}),
        ("any", set(JOINT_NAMES)),
    ],
)
def test_what_is_left_open_is_drawn_from_the_seed(joint: str, among: set[str]) -> None:
    found = [weak(f"any:{joint}:2", seed)[0] for seed in range(100)]
    assert {JOINT_NAMES[motor.joint] for motor in found} == among
    assert {motor.robot for motor in found} == {0, 1, 2}
    assert weak(f"any:{joint}:2", 7) == weak(f"any:{joint}:2", 7)
