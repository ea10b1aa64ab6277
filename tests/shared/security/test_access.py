"""Rights and limits follow from the table of topics: each for its own, and the rest denied."""

from __future__ import annotations

from typing import Any

import pytest

from quadriga.shared.codec import MAX_BYTES
from quadriga.shared.config.load import load
from quadriga.shared.runtime.places import SOURCE
from quadriga.shared.security.access import (
    Rights,
    access_control,
    identity_of,
    router_rules,
    team_identities,
    team_rights,
)
from quadriga.shared.topics import COMMAND, STATE, TABLE

EACH = {"team.plant_per_robot": True, "world.mode": "realtime", "team.yokes": "none"}
TWO = load(None, {"team.robots": 2})


def rights(**given: object) -> dict[str, Rights]:
    return team_rights(load(None, {"team.robots": 2, **given}))


def test_a_robot_sends_under_its_own_key_and_hears_its_own_state() -> None:
    own = {f"team/r1/{n}" for n in ["measurement", "plan", "status", "inputs", "event", "ticks"]}
    assert {*rights()["r1"].publishes} == {*own, "team/@link/r1/command", "team/estop"}
    of_all = {f"team/*/{name}" for name in ("plan", "measurement", "status")}
    of_team = {f"team/{name}" for name in ("reference", "estop", "stop", "reset", "resume")}
    world = {"team/sim/truth", "team/sim/event"}
    assert {*rights()["r1"].hears} == {"team/@link/r1/state", *of_all, *of_team, *world}


@pytest.mark.parametrize(
    ("word", "speakers"),
    [
        ("reference", {"operator"}),
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
        assert not hears_only or (each.publishes, each.hears) == ([], ["team/**"])


def test_the_world_speaks_for_all_robots_and_the_plant_of_one_for_it_alone() -> None:
    sent = {*rights()["sim"].publishes}
    of_link = {"team/@link/r1/state", "team/@link/r2/state"}
    assert {*of_link, "team/sim/status", "team/sim/ticks", "team/clock"} <= sent
    assert not [key for key in sent if key.endswith(("command", "plan", "reference"))]
    found = rights(**EACH)
    assert "sim" not in found
    first, second = {*found["plant_r1"].publishes}, {*found["plant_r2"].publishes}
    assert {"team/@link/r2/state", "team/plant_r2/status", "team/plant_r2/ticks"} <= second
    of_first = {"team/@link/r1/state", "team/plant_r1/ticks"}
    assert not {*of_first, "team/clock", "team/sim/truth"} & second
    assert "team/clock" in first
    assert "team/@link/r2/state" not in first


def keys_of(block: dict[str, Any], identity: str, flow: str) -> set[str]:
    (names,) = [p["rules"] for p in block["policies"] if p["subjects"] == [identity]]
    own = [rule for rule in block["rules"] if rule["id"] in names and rule["flows"] == [flow]]
    return {key for rule in own if rule["messages"] == ["put"] for key in rule["key_exprs"]}


def test_the_router_denies_whatever_no_identity_has_a_right_to() -> None:
    block = access_control(TWO)
    assert (block["enabled"], block["default_permission"]) == (True, "deny")
    assert all(rule["permission"] == "allow" for rule in block["rules"])
    assert all("interfaces" not in entry for entry in (*block["rules"], *block["subjects"]))
    ids = [rule["id"] for rule in block["rules"]]
    assert len(ids) == len({*ids})
    names = {s["id"]: s["cert_common_names"] for s in block["subjects"]}
    assert names == {name: [name] for name in rights()}
    for name, own in rights().items():
        assert keys_of(block, name, "ingress") == {*own.publishes}
        assert keys_of(block, name, "egress") == {*own.hears}


def row(name: str, each: Rights) -> str:
    def cell(keys: list[str]) -> str:
        return ", ".join(f"`{key.partition('/')[2]}`" for key in keys) or "nothing"

    return f"| `{name}` | {cell(each.publishes)} | {cell(each.hears)} |\n"


def test_the_page_on_security_has_the_rights_of_everybody() -> None:
    page = (SOURCE / "docs" / "security.md").read_text(encoding="utf-8")
    rows = "".join(row(*each) for each in (rights(**EACH) | rights()).items())
    assert all(line in page for line in rows.splitlines()), f"it should have\n{rows}"


def test_everybody_who_may_be_on_the_bus_has_an_identity() -> None:
    always = {"operator", "recorder", "planner", "launcher", "estop", "doctor"}
    always |= {"stop", "reset", "resume", "observer", "router"}
    assert {who.name for who in team_identities(TWO)} == {"sim", "r1", "r2", *always}
    alone = load(None, {"team.robots": 1, **EACH, "recorder.enabled": False})
    assert {who.name for who in team_identities(alone)} == {"plant_r1", "r1", *always}
    assert (identity_of("echo-4711"), identity_of("plant_r1")) == ("observer", "plant_r1")


def test_nobody_takes_more_than_its_share_of_the_router() -> None:
    found = router_rules(TWO)
    assert found["transport/link/rx/max_message_size"] == MAX_BYTES
    assert found["transport/unicast/max_links"] == 1
    assert found["transport/unicast/max_sessions"] > len(team_identities(TWO))


def test_every_topic_has_somebody_who_may_send_it() -> None:
    for found in (rights(), rights(**EACH)):
        sent = {key for each in found.values() for key in each.publishes}
        for topic in TABLE:
            key = topic.link_key if topic in (STATE, COMMAND) else topic.key
            assert {key("team", robot) for robot in ("r1", "r2")} <= sent
