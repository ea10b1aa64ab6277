import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shared.errors import ConfigError
from shared.robot import robot_names
from sim_server.scenario import build_scenario, parse_pushes
from sim_server.team_model import payload_shares
from tests.sim_server.standing import configured

NAMES = robot_names(3)


def test_pushes_are_parsed() -> None:
    first, second = parse_pushes("r2:80:90:1:0.2, all:-0:0:0:0.001", NAMES)
    assert (first.robots, first.force, first.start, first.stop) == ((1,), 80.0, 1000, 1200)
    assert first.direction == pytest.approx(math.pi / 2)
    assert second.robots == (0, 1, 2)
    assert parse_pushes("", NAMES) == ()


@pytest.mark.parametrize(
    ("text", "said"),
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
def test_a_wrong_push_names_the_key_and_what_is_wrong(text: str, said: str) -> None:
    with pytest.raises(ConfigError, match=rf"^world\.push: .*{said}"):
        parse_pushes(text, NAMES)


@given(st.text(alphabet="rall0123:.,- e", max_size=30))
def test_any_text_is_parsed_or_refused(text: str) -> None:
    try:
        pushes = parse_pushes(text, NAMES)
    except ConfigError:
        return  # anything else fails the test
    assert len(pushes) == (text.count(",") + 1 if text else 0)


def test_forces_add_up_and_end() -> None:
    config = configured(3, push="all:10:0:1:1,r2:20:90:1.5:1")
    scenario = build_scenario(config, payload_shares(config))
    assert scenario.changes() == {1000, 2000, 1500, 2500}
    along, left, none = np.array([10.0, 0.0, 0.0]), np.array([0.0, 20.0, 0.0]), np.zeros(3)
    expected = {
        999: [none] * 3,
        1000: [along] * 3,
        1999: [along, along + left, along],
        2000: [none, left, none],
        2500: [none] * 3,
    }
    for tick, forces in expected.items():
        np.testing.assert_allclose(scenario.forces(tick), forces, atol=1e-12)


def test_events_announce_what_was_configured() -> None:
    config = configured(
        3, push="r3:80:90:2:0.2,all:5:0:1:1", payload=9.0, payload_on="r2", terrain="boxes"
    )
    events = build_scenario(config, payload_shares(config)).events
    assert [(event.tick, event.kind, event.robot) for event in events] == [
        (0, "start", ""), (0, "terrain", ""), (0, "payload", "r2"),
        (1000, "push", "r1"), (1000, "push", "r2"), (1000, "push", "r3"), (2000, "push", "r3"),
    ]  # fmt: skip
    assert events[2].detail == "9 kg"
    assert events[-1].detail == "80 N towards 90 deg for 0.2 s"
    assert events[-1].stamp_ns == 2_000_000_000
