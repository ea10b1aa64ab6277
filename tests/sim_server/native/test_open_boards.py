"""Where the simulated robots are, and where their bridges look for them."""

from __future__ import annotations

from dataclasses import replace

import pytest

from quadriga.bridges.bridge import bridge_of
from quadriga.shared.config.load import load
from quadriga.shared.errors import BridgeError
from quadriga.sim_server.native.open_boards import open_boards
from tests.bridges.test_udp_driver import HOST, free_port


def test_each_robot_may_have_an_interface_of_its_own_and_then_domain_0_like_a_real_one() -> None:
    config = load(
        overrides={"team.robot": "go2", "team.robots": 2, "bridge.interface": "nowhere{number}"}
    )
    ways = [bridge_of(config, name) for name in ("r1", "r2")]
    assert [(way.interface, way.domain) for way in ways] == [("nowhere1", 0), ("nowhere2", 0)]
    with pytest.raises(BridgeError, match="DDS domain 0 on 'nowhere1': got error"):
        open_boards(config)


def test_on_the_loopback_they_have_domains_of_their_own() -> None:
    config = load(
        overrides={
            "team.robot": "go2",
            "team.robots": 2,
            "bridge.interface": "lo",
            "bridge.domain": 186,
        }
    )
    ways = [bridge_of(config, name) for name in ("r1", "r2")]
    assert [(way.interface, way.domain) for way in ways] == [("lo", 186), ("lo", 187)]


def test_what_is_open_is_closed_if_another_cannot_be_opened() -> None:
    port = free_port()
    config = load(
        overrides={
            "team.robots": 2,
            "bridge.endpoint": f"{HOST}:{port}",  # the same for both
        }
    )
    for _ in range(2):  # the first robot's port is free again
        with pytest.raises(BridgeError, match=f"UDP port {port} of {HOST}: got Address already"):
            open_boards(config)
    (board,) = open_boards(replace(config, team=replace(config.team, robots=1))).values()
    board.close()
