"""The table of topics: every key leads back to its row, every message type has one."""

from __future__ import annotations

import pytest

from quadriga.agents.inbox import Inbox
from quadriga.shared import members
from quadriga.shared.config.load import load
from quadriga.shared.config.timing import max_ages, periods
from quadriga.shared.errors import MessageError
from quadriga.shared.messages import Flat, Message
from quadriga.shared.schema import to_markdown
from quadriga.shared.topics import (
    AGENT_EVENT,
    CONFIGURED,
    INJECTED,
    STATUS,
    TABLE,
    Topic,
    topic_of,
    topics_for,
)

rows = pytest.mark.parametrize("topic", TABLE, ids=lambda topic: topic.name)


@rows
def test_a_row_is_plausible_and_its_key_leads_back_to_it(topic: Topic) -> None:
    for team in ("team", "a-b.c"):
        robot = "r2" if topic.per_robot else ""
        assert topic_of(topic.key(team, robot)) == (topic, robot)
    assert topic.period_ms >= 0 or topic.period_ms == CONFIGURED
    assert topic.max_age_ms >= 0 or topic.max_age_ms == CONFIGURED
    roles = {role.name for role in members.ROLES} | {members.LAUNCHER, members.ROUTER}
    roles |= {members.ESTOP, members.STOP, members.RESET, members.RESUME}
    assert topic.senders
    assert {*topic.senders, *topic.receivers} <= roles
    its_own = {members.AGENT, members.SIM} & {*topic.senders, *topic.receivers}
    assert not topic.per_robot or its_own
    assert f"| `{topic.name}` |" in to_markdown()


@rows
@pytest.mark.parametrize("preset", ["usual", "fast"])
def test_an_input_may_miss_a_turn_before_it_is_too_old(topic: Topic, preset: str) -> None:
    config = load(None, {"planner.preset": preset})
    period, age = periods(config)[topic.name], max_ages(config)[topic.name]
    assert 0 <= period <= 1000
    assert age == 0 or age >= 2 * period


@pytest.mark.parametrize("kind", ["distributed", "centralised", "none"])
@pytest.mark.parametrize("estimator", ["kalman", "truth"])
@pytest.mark.parametrize("mode", ["lockstep", "realtime"])
def test_an_agent_takes_what_the_table_says(kind: str, estimator: str, mode: str) -> None:
    given = {"planner.kind": kind, "estimator.kind": estimator, "world.mode": mode}
    taken = {topic for topic, _ in Inbox(load(None, given), "r1", ["r2"]).topics.values()}
    assert taken <= {*topics_for(members.AGENT)}
    if kind == "distributed" and estimator == "truth":
        unheard = set() if mode == "realtime" else {STATUS}
        assert taken == {*topics_for(members.AGENT)} - unheard


def test_every_message_type_has_a_row_and_every_row_a_name() -> None:
    """Events have three rows: only those of the plant, not of agents or launcher, may end a walk."""
    others = (AGENT_EVENT, INJECTED)
    types = [topic.type.__name__ for topic in TABLE if topic not in others]
    kinds = {*Message.__subclasses__(), *Flat.__subclasses__()} - {Flat}
    kinds = {kind for kind in kinds if kind.__module__ == Message.__module__}
    assert sorted(types) == sorted(kind.__name__ for kind in kinds)
    assert len({topic.name for topic in TABLE}) == len(TABLE)


def test_the_keys_are_the_contract_with_other_tools() -> None:
    of_robot = ["state", "command", "measurement", "plan", "status", "inputs", "event", "ticks"]
    of_people = ["reference", "estop", "stop", "reset", "resume", "fault", "injected"]
    of_team = [*of_people, "sim/truth", "sim/event", "clock"]
    keys = {f"team/r1/{name}" for name in of_robot} | {f"team/{name}" for name in of_team}
    assert {topic.key("team", "r1") for topic in TABLE} == keys


@pytest.mark.parametrize(
    "key", ["", "team", "team/r1", "team/r1/stat", "team/state", "team/r1/x/state"]
)
def test_a_foreign_key_is_refused(key: str) -> None:
    with pytest.raises(MessageError, match="key"):
        topic_of(key)
