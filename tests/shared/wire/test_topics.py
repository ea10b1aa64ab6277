"""The table of topics: every key leads back to its row, every message type has one."""

from __future__ import annotations

import pytest

from quadriga.shared.errors import MessageError
from quadriga.shared.wire.messages import Flat, Message
from quadriga.shared.wire.topics import TABLE, Topic, topic_of

rows = pytest.mark.parametrize("topic", TABLE, ids=lambda topic: topic.name)


@rows
@pytest.mark.parametrize("team", ["team", "a-b.c"])
def test_a_key_leads_back_to_its_row(topic: Topic, team: str) -> None:
    robot = "r2" if topic.per_robot else ""
    assert topic_of(topic.key(team, robot)) == (topic, robot)


@rows
def test_a_row_is_plausible(topic: Topic) -> None:
    assert 0.0 <= topic.rate_hz <= 1000.0
    # An input must be allowed to miss at least one turn before it counts as too old.
    assert topic.max_age_ms == 0 or topic.rate_hz == 0 or topic.max_age_ms >= 2e3 / topic.rate_hz


def test_every_message_type_has_one_row_and_one_name() -> None:
    types = [topic.type.__name__ for topic in TABLE]
    kinds = {*Message.__subclasses__(), *Flat.__subclasses__()} - {Flat}
    assert sorted(types) == sorted(kind.__name__ for kind in kinds)
    assert len({topic.name for topic in TABLE}) == len(TABLE)


def test_the_keys_are_the_contract_with_other_tools() -> None:
    assert [topic.key("team", "r1") for topic in TABLE] == [
        "team/r1/state",
        "team/r1/command",
        "team/r1/measurement",
        "team/r1/plan",
        "team/r1/status",
        "team/r1/inputs",
        "team/reference",
        "team/estop",
        "team/sim/truth",
        "team/sim/event",
    ]


@pytest.mark.parametrize(
    "key", ["", "team", "team/r1", "team/r1/stat", "team/state", "team/r1/x/state"]
)
def test_a_foreign_key_is_refused(key: str) -> None:
    with pytest.raises(MessageError, match="key"):
        topic_of(key)
