"""Rights and limits follow from the table of topics: each for its own, and the rest denied."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from quadriga.shared.codec import MAX_BYTES, encode
from quadriga.shared.config.load import load
from quadriga.shared.messages import Event, Message, Plan, Status, Truth
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.security.access import (
    Rights,
    access_control,
    capacity,
    identity_of,
    largest,
    team_identities,
    team_rights,
)
from quadriga.shared.security.markdown import PAGE, renewed
from quadriga.shared.topics import COMMAND, STATE, TABLE, Topic

EACH = {"team.plant_per_robot": True, "world.mode": "realtime", "team.yokes": "none"}


def rights(**given: object) -> dict[str, Rights]:
    config = load(None, {"team.robots": 2, **{k.replace("__", "."): v for k, v in given.items()}})
    return {each.identity.name: each for each in team_rights(config)}


def test_a_robot_sends_under_its_own_key_only() -> None:
    sent = rights()["r1"].publishes
    assert {key for key in sent if key != "team/estop"} == {
        f"team/r1/{name}"
        for name in ("command", "measurement", "plan", "status", "inputs", "event")
    }


def test_a_robot_hears_its_own_state_and_what_the_others_plan_measure_and_do() -> None:
    assert {*rights()["r1"].hears} == {
        "team/r1/state",
        "team/*/plan",
        "team/*/measurement",
        "team/*/status",
        "team/reference",
        "team/estop",
        "team/stop",
        "team/reset",
        "team/resume",
        "team/sim/truth",
        "team/sim/event",
    }


def test_the_operator_asks_for_speeds_and_may_stop_the_team() -> None:
    sent = {"team/reference", "team/estop", "team/stop", "team/reset", "team/resume"}
    assert {*rights()["operator"].publishes} == sent


@pytest.mark.parametrize(
    ("word", "speakers"),
    [
        ("resume", {"operator", "reset", "resume"}),
        ("stop", {"operator", "stop"}),
        ("reset", {"operator", "reset"}),
    ],
)
def test_only_who_has_that_task_may_say_a_word(word: str, speakers: set[str]) -> None:
    may = {name for name, each in rights().items() if f"team/{word}" in each.publishes}
    assert may == speakers
    for name in speakers - {"operator"}:
        assert {"team/*/status", "team/sim/event", "team/clock"} <= {*rights()[name].hears}


def test_anyone_in_the_team_may_stop_it_and_who_only_hears_says_nothing() -> None:
    for name, each in rights().items():
        hears_only = name in ("recorder", "observer", "doctor")
        assert ("team/estop" in each.publishes) is (not hears_only), name
        assert not (hears_only and each.publishes)
        assert not hears_only or each.hears == ("team/**",)


def test_the_world_speaks_for_all_robots_and_commands_none() -> None:
    sent = {*rights()["sim"].publishes}
    assert {"team/r1/state", "team/r2/state", "team/sim/status", "team/clock"} <= sent
    assert not [key for key in sent if key.endswith(("command", "plan", "reference"))]


def test_the_plant_of_one_robot_speaks_for_it_alone_and_the_first_drives_time() -> None:
    found = rights(**EACH)
    assert "sim" not in found
    first, second = {*found["plant_r1"].publishes}, {*found["plant_r2"].publishes}
    assert {"team/r2/state", "team/plant_r2/status"} <= second
    assert not {"team/r1/state", "team/clock", "team/sim/truth"} & second
    assert "team/clock" in first
    assert "team/r2/state" not in first


def test_every_topic_has_somebody_who_may_send_it() -> None:
    for found in (rights(), rights(**EACH)):
        sent = {key for each in found.values() for key in each.publishes}
        for topic in TABLE:
            for key in (topic.key("team", "r1"), topic.key("team", "r2")):
                assert key in sent, key


def rules_of(block: dict[str, Any], identity: str) -> list[dict[str, Any]]:
    (names,) = [p["rules"] for p in block["policies"] if p["subjects"] == [identity]]
    return [rule for rule in block["rules"] if rule["id"] in names]


def test_the_block_is_enabled_denies_by_default_and_holds_for_every_link() -> None:
    block = access_control(load(None, {"team.robots": 2}))
    assert block["enabled"] is True
    assert block["default_permission"] == "deny"
    assert all(rule["permission"] == "allow" for rule in block["rules"])
    assert all("interfaces" not in entry for entry in (*block["rules"], *block["subjects"]))
    ids = [rule["id"] for rule in block["rules"]]
    assert len(ids) == len({*ids})


def test_each_identity_is_known_by_its_common_name() -> None:
    block = access_control(load(None, {"team.robots": 2}))
    found = {each["id"]: each["cert_common_names"] for each in block["subjects"]}
    assert found == {name: [name] for name in rights()}
    assert "router" not in found


@pytest.mark.parametrize("identity", ["r1", "recorder", "observer"])
def test_what_is_sent_comes_in_and_what_is_heard_goes_out(identity: str) -> None:
    block = access_control(load(None, {"team.robots": 2}))
    own = rights()[identity]
    put_in, put_out = (
        {
            k
            for r in rules_of(block, identity)
            if r["messages"] == ["put"] and r["flows"] == [flow]
            for k in r["key_exprs"]
        }
        for flow in ("ingress", "egress")
    )
    assert (put_in, put_out) == ({*own.publishes}, {*own.hears})


def test_the_page_is_in_step_with_the_rights() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert "`operator`" in renewed(page)
    assert renewed(page) == page, "make docs"


def names(**keys: object) -> set[str]:
    given = {name.replace("__", "."): value for name, value in keys.items()}
    return {who.name for who in team_identities(load(None, given))}


def test_everybody_who_may_be_on_the_bus_has_an_identity() -> None:
    always = {"operator", "recorder", "planner", "launcher", "estop", "doctor"}
    always |= {"stop", "reset", "resume", "observer", "router"}
    assert names(team__robots=2) == {"sim", "r1", "r2", *always}
    assert names(team__robots=1, **EACH) == {"plant_r1", "r1", *always}
    assert names(planner__kind="centralised", recorder__enabled=False) == names()
    assert identity_of("echo-4711") == "observer"
    assert identity_of("plant_r1") == "plant_r1"


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


def test_every_topic_has_a_size() -> None:
    config = load(None, {"team.robots": 2})
    found = capacity(config)
    sized = {key for rule in found["low_pass_filter"] for key in rule["key_exprs"]}
    assert {topic.key("team", "*") for topic in TABLE} <= sized
    assert found["transport/unicast/max_links"] == 1
    assert found["transport/unicast/max_sessions"] > len(team_identities(config))
