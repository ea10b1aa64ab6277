"""The plant obeys the emergency stop itself: from the next tick on every joint is damped."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest

from quadriga.plant.late import MOTOR_DAMPING
from quadriga.plant.server import PlantServer
from quadriga.plant.team_time import FollowerTime
from quadriga.shared.bus.zenoh_bus import Bus
from quadriga.shared.config.sections import Config
from quadriga.shared.wire import codes
from quadriga.sim_server.world.world import World
from tests.plant.test_server import Listener, served
from tests.sim_server.standing import STAND


def test_whatever_agents_command_after_it_the_joints_are_damped() -> None:
    server, listener = served(spawn="standing")
    for _ in range(50):
        server.step({"r1": STAND})
    reasons = iter(["operator: dog"])
    server.estops = lambda: next(reasons, "")
    for _ in range(100):
        before = server.plant.states()["r1"]
        server.step({"r1": STAND})
        tau = server.plant.states()["r1"].tau_joint
        np.testing.assert_allclose(tau, -MOTOR_DAMPING * before.v_joint, atol=1e-12)
    stops = [event for event in listener.events() if event.code == codes.ESTOPPED]
    assert [(e.tick, e.robot, e.kind) for e in stops] == [(50, "", "fault")]
    assert stops[0].detail.startswith("operator: dog")


@pytest.mark.parametrize("pressed", [False, True])
def test_nobody_is_led_down_slowly_after_it(pressed: bool) -> None:
    server, listener = served()
    server.estops = lambda: "now" if pressed else ""
    for _ in range(10):
        server.step({})
    told = {event.code for event in listener.events()}
    assert (codes.LOWERED in told) is not pressed
    assert (codes.ESTOPPED in told) is pressed


def test_a_world_of_one_robot_among_several_names_it() -> None:
    config, listener = Config(), Listener()
    world = World(config, ("r2",))
    server = PlantServer(config, world, cast("Bus", listener), FollowerTime(config))
    server.estops = lambda: "now"
    server.step({"r2": STAND})
    assert [e.robot for e in listener.events() if e.code == codes.ESTOPPED] == ["r2"]
