"""Rights follow from the table of topics: each for its own, and the rest denied."""

from __future__ import annotations

from typing import Any

import pytest

from quadriga.shared.config.load import load
from quadriga.shared.security.access import Rights, access_control, team_rights
from quadriga.shared.security.markdown import PAGE, renewed
from quadriga.shared.wire.topics import TABLE

EACH = {"team.plants": "each", "team.yokes": "none"}


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
    assert {"team/r2/state", "team/plant_r2/status", "team/r2/clock_ask"} <= second
    assert not {"team/r1/state", "team/clock", "team/sim/truth", "team/r1/clock_answer"} & second
    assert {"team/clock", "team/r2/clock_answer"} <= first
    assert "team/r2/state" not in first


def test_every_topic_has_somebody_who_may_send_it() -> None:
    for found in (rights(), rights(**EACH)):
        sent = {key for each in found.values() for key in each.publishes}
        for topic in TABLE:
            for key in (topic.key("team", "r1"), topic.key("team", "r2")):
                alone = topic.name in ("clock_answer", "clock_ask")
                assert key in sent or alone, key


def rules_of(block: dict[str, Any], identity: str) -> list[dict[str, Any]]:
    (names,) = [p["rules"] for p in block["policies"] if p["subjects"] == [identity]]
    return [rule for rule in block["rules"] if rule["id"] in names]


def test_the_block_is_enabled_denies_by_default_and_holds_for_every_link() -> None:
    block = access_control(load(None, {"team.robots": 2}), {"r1": 3})
    assert block["enabled"] is True
    assert block["default_permission"] == "deny"
    assert all(rule["permission"] == "allow" for rule in block["rules"])
    assert all("interfaces" not in entry for entry in (*block["rules"], *block["subjects"]))
    ids = [rule["id"] for rule in block["rules"]]
    assert len(ids) == len({*ids})


def test_common_names_are_literal_and_revoked_ones_are_left_out() -> None:
    block = access_control(load(None, {"team.robots": 2}), {"r1": 3})
    names = {each["id"]: each.get("cert_common_names", []) for each in block["subjects"]}
    assert "router" not in names
    assert names["r1"][0] == "r1.4"
    assert names["r2"][0] == "r2.1"
    assert not [name for each in names.values() for name in each if "*" in name]


@pytest.mark.parametrize("identity", ["r1", "recorder", "observer"])
def test_what_is_sent_comes_in_and_what_is_heard_goes_out(identity: str) -> None:
    block = access_control(load(None, {"team.robots": 2}), {})
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
