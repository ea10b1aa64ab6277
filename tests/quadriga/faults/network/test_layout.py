"""Places of an emulated network: each with an address and a device of its own."""

from __future__ import annotations

from dataclasses import replace
from ipaddress import IPv4Network, ip_address

import pytest

from quadriga.faults.network.layout import NETWORKS, TEAM, NetworkLayout
from quadriga.shared.bus.settings import member_settings
from quadriga.shared.config.sections import Config
from quadriga.shared.members import OPERATOR, RECORDER, SIM

_LONGEST_DEVICE = 15  # characters, linux/if.h


def build(number: int = 300, robots: int = 10, *, wired: bool = True) -> NetworkLayout:
    config = Config()
    config = replace(config, team=replace(config.team, robots=robots))
    return NetworkLayout.of_team(config, number, wired=wired)


@pytest.mark.parametrize("number", [0, 255, 256, NETWORKS - 1])
def test_addresses_are_of_the_network_and_of_one_place_each(number: int) -> None:
    layout = build(number)
    addresses = [layout.address(place) for place in layout.places]
    assert len(set(addresses)) == len(addresses) == 12
    network = IPv4Network(layout.subnet)
    assert network.subnet_of(IPv4Network("198.18.0.0/15"))
    assert all(ip_address(address) in network for address in addresses)
    assert [layout.hosts[int(a.rpartition(".")[2])] for a in addresses] == list(layout.places)


def test_networks_of_two_processes_have_nothing_in_common() -> None:
    one, two = build(7), build(NETWORKS + 8)
    assert one.subnet != two.subnet
    assert one.air(TEAM) != two.air(TEAM)
    assert not {one.cable(r) for r in one.robots} & {two.cable(r) for r in two.robots}
    devices = [build(NETWORKS - 1).cable("r10"), build(NETWORKS - 1).air(TEAM)]
    assert max(map(len, devices)) <= _LONGEST_DEVICE


def test_agents_are_with_their_robots_and_a_wired_team_has_its_operator_on_the_air() -> None:
    whole, split = build(robots=2, wired=False), build(robots=2)
    names = ("r1", "r2", SIM, OPERATOR, RECORDER, "router", "planner")
    assert [whole.place_of(name) for name in names] == ["r1", "r2", *[TEAM] * 5]
    assert [split.place_of(name) for name in names] == ["r1", "r2", TEAM, OPERATOR, *[TEAM] * 3]


def test_what_wired_robots_tell_each_other_takes_no_router_at_the_cables() -> None:
    config = replace(Config(), bus=replace(Config().bus, mode="client"))
    modes = {wired: build(wired=wired).with_endpoints(config).bus.mode for wired in (False, True)}
    assert modes == {False: "client", True: "peer"}


def test_a_team_may_meet_at_its_endpoint() -> None:
    layout = build(robots=2)
    bus = layout.with_endpoints(Config()).bus
    assert member_settings(bus, SIM)["listen/endpoints"] == [layout.endpoint(TEAM)]
    there = replace(bus, listen=layout.endpoint("r2", 0))
    settings = member_settings(there, "r2")
    assert settings["connect/endpoints"] == [layout.endpoint(TEAM)]
    assert settings["listen/endpoints"] == [f"tcp/{layout.address('r2')}:0"]
