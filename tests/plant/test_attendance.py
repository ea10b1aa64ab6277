"""In real time it is announced, once each, who is gone, is silent, or answers again."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

from quadriga.plant.attendance import note_absences
from quadriga.plant.server import PlantServer
from quadriga.plant.team_time import FollowerTime
from quadriga.shared import codes
from quadriga.shared.bus.session import Bus
from quadriga.sim_server.world.world import World
from tests.plant.test_server import Listener
from tests.sim_server.standing import STAND, configured


class Meeting(Listener):
    """A bus on which it can be said who is there."""

    def __init__(self) -> None:
        super().__init__()
        self.there = {"r1", "r2", "operator"}

    def members_at(self, stage: str) -> frozenset[str]:
        return frozenset(self.there)


def walk(server: PlantServer, until: int, silent: str = "") -> None:
    """Let the robots command each tick, all but one."""
    while server.plant.tick < until:
        tick = server.plant.tick
        for name in server.plant.names:
            if name != silent:
                server.commands.latest[name] = replace(STAND, tick=tick)
        if tick % 10 == 0:
            note_absences(server)
        server.plant.step({"r1": STAND, "r2": STAND})


def test_who_leaves_who_is_silent_and_who_is_back() -> None:
    config, bus = configured(2, mode="realtime"), Meeting()
    server = PlantServer(config, World(config), cast("Bus", bus))
    walk(server, 100)
    assert bus.events() == []
    walk(server, 400, silent="r2")
    bus.there -= {"r1"}
    walk(server, 420, silent="r2")
    walk(server, 440)
    bus.there |= {"r1"}
    walk(server, 500)
    told = [(event.tick, event.robot, event.code) for event in bus.events()]
    assert told == [
        (300, "r2", codes.SILENT),
        (400, "r1", codes.GONE),
        (420, "r2", codes.BACK),
        (440, "r1", codes.BACK),
    ]


def test_an_operator_that_leaves_and_comes_back_is_announced_by_who_drives_time() -> None:
    config, bus = configured(2, mode="realtime"), Meeting()
    server = PlantServer(config, World(config), cast("Bus", bus))
    walk(server, 100)
    bus.there -= {"operator"}
    walk(server, 200)
    bus.there |= {"operator"}
    walk(server, 300)
    told = [(event.tick, event.robot, event.code) for event in bus.events()]
    assert told == [(100, "", codes.OPERATOR_GONE), (200, "", codes.OPERATOR_BACK)]


def test_a_follower_announces_no_operator() -> None:
    config, bus = configured(2, mode="realtime"), Meeting()
    server = PlantServer(config, World(config), cast("Bus", bus), FollowerTime(config))
    bus.there -= {"operator"}
    walk(server, 100)
    assert bus.events() == []


def test_a_robot_whose_commands_always_come_late_is_announced() -> None:
    config, bus = configured(2, mode="realtime"), Meeting()
    server = PlantServer(config, World(config), cast("Bus", bus))
    walk(server, 100)
    server.late_ms["r2"] = config.world.command_damp_ms
    walk(server, 200)
    assert bus.events() == []
    server.late_ms["r2"] += 1
    walk(server, 300)
    server.late_ms["r2"] = 0
    walk(server, 400)
    told = [(event.tick, event.robot, event.code) for event in bus.events()]
    assert told == [(200, "r2", codes.SILENT), (300, "r2", codes.BACK)]
