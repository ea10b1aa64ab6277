"""No message is larger than its type can be, and what the team sends fits."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.shared.config.load import load
from quadriga.shared.robot.conventions import robot_names
from quadriga.shared.security.caps import capacity, greatest_rate, largest
from quadriga.shared.security.roll import team_roll
from quadriga.shared.wire.codec import MAX_BYTES, encode
from quadriga.shared.wire.messages import Event, Message, Plan, Status, Truth
from quadriga.shared.wire.topics import COMMAND, ESTOP, MEASUREMENT, REFERENCE, STATE, TABLE, Topic

LONG = "ä" * 4096
N = 100
LARGEST: tuple[Message, ...] = (
    Plan(
        1 << 41,
        1 << 61,
        1 << 61,
        np.ones((N, 12)),
        np.ones((N, 6)),
        LONG,
        {f"r{k}": 1 << 61 for k in range(10)},
        1 << 61,
    ),
    Truth(
        1 << 41,
        1 << 61,
        robot_names(10),
        np.ones((10, 3)),
        np.ones((10, 4)),
        np.ones((10, 3)),
        np.ones((10, 3)),
        np.ones((10, 4, 3)),
        np.ones(45),
        np.ones(45),
    ),
    Event.of(1 << 41, "fall", "r10", LONG),
    Status(
        1 << 41,
        1 << 61,
        LONG,
        LONG,
        "kalman",
        {f"age{k}": 1.0 for k in range(50)},
        {f"counter{k}": 1 << 61 for k in range(50)},
        np.ones(1000),
        np.ones(10_000),
    ),
)


@pytest.mark.parametrize("message", LARGEST, ids=lambda message: type(message).__name__)
def test_the_largest_message_of_a_type_fits(message: Message) -> None:
    assert len(encode(message)) <= largest(type(message))


@pytest.mark.parametrize("topic", TABLE, ids=lambda topic: topic.name)
def test_no_type_takes_more_than_the_codec_would(topic: Topic) -> None:
    assert 0 < largest(topic.type) <= MAX_BYTES


def test_what_is_sent_a_thousand_times_a_second_is_small() -> None:
    assert largest(STATE.type) < 2048
    assert largest(COMMAND.type) < 2048


def test_only_messages_of_every_tick_have_a_rate() -> None:
    assert greatest_rate(STATE) == greatest_rate(COMMAND) == 200_000.0
    assert not any(map(greatest_rate, (ESTOP, REFERENCE, MEASUREMENT)))


def test_rates_have_concrete_keys_and_every_topic_a_size() -> None:
    config = load(None, {"team.robots": 2})
    found = capacity(config)
    keys = [rule["key_expr"] for rule in found["downsampling"][0]["rules"]]
    assert {"team/r1/command", "team/r2/state"} <= {*keys}
    assert not [key for key in keys if "*" in key]
    sized = {key for rule in found["low_pass_filter"] for key in rule["key_exprs"]}
    assert {topic.key("team", "*") for topic in TABLE} <= sized
    assert found["transport/unicast/max_links"] == 1
    assert found["transport/unicast/max_sessions"] > len(team_roll(config))
