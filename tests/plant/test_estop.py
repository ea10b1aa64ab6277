"""The plant obeys the emergency stop itself: from the next tick on every joint is damped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import cast

import numpy as np
import pytest

from quadriga.plant.commands import MOTOR_DAMPING
from quadriga.plant.server import STOP_LINGER_MS, PlantServer
from quadriga.shared import codes
from quadriga.shared.bus.session import Bus
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import EStop, Message, Reset, SafeStop
from quadriga.sim_server.world.world import World
from tests.plant.test_server import Listener, served
from tests.sim_server.standing import STAND


def ask(server: PlantServer, *requests: Sequence[Message]) -> None:
    """Have people ask for something at each of the next ticks, and nothing after."""
    asked = iter(requests)
    server.requests = lambda: next(asked, ())


def test_whatever_agents_command_after_it_the_joints_are_damped() -> None:
    server, listener = served(initial_posture="standing")
    for _ in range(50):
        server.step({"r1": STAND})
    ask(server, [EStop(0, 0, "operator: dog")])
    for _ in range(100):
        before = server.plant.states()["r1"]
        server.step({"r1": STAND})
        tau = server.plant.states()["r1"].tau_joint
        np.testing.assert_allclose(tau, -MOTOR_DAMPING * before.v_joint, atol=1e-12)
    stops = [event for event in listener.events() if event.code == codes.ESTOPPED]
    assert [(e.tick, e.robot, e.kind) for e in stops] == [(50, "", "fault")]
    assert stops[0].detail.startswith("operator: dog")


def test_a_world_of_one_robot_among_several_names_it() -> None:
    config, listener = Config(), Listener()
    world = World(config, ("r2",))
    server = PlantServer(config, world, cast("Bus", listener), "r2")
    ask(server, [EStop(0, 0, "now")])
    server.step({"r2": STAND})
    assert [e.robot for e in listener.events() if e.code == codes.ESTOPPED] == ["r2"]


def reset(tick: int, by: str = "ann") -> list[Message]:
    return [Reset(tick, 0, by)]


PRESSED: list[Message] = [EStop(0, 0, "dog")]
NOBODY: list[Message] = []


@pytest.mark.parametrize(
    ("asked", "stops", "releases"),
    [
        ([[*reset(0), *PRESSED], NOBODY, reset(2)], [0], [2]),
        ([PRESSED, reset(0), PRESSED, reset(0), reset(9, "bob")], [0, 2], [1, 4]),  # came twice
        ([NOBODY, PRESSED, reset(0), reset(1)], [1], [3]),  # was said before the stop
        ([PRESSED] * 250, [0, 100, 200], []),  # an answer, though not at every tick
    ],
)
def test_only_a_release_that_was_said_after_it_ends_it(
    asked: list[list[Message]], stops: list[int], releases: list[int]
) -> None:
    server, listener = served(initial_posture="standing")
    ask(server, *asked)
    damped, command = False, replace(STAND, tau=np.ones(12))
    for tick in range(len(asked)):
        v_joint = server.plant.states()["r1"].v_joint
        server.step({"r1": command})
        tau = server.plant.states()["r1"].tau_joint
        damped = tick in stops or (damped and tick not in releases)
        assert np.allclose(tau, -MOTOR_DAMPING * v_joint, atol=1e-12) == damped
    told = [(e.tick, e.code) for e in listener.events() if e.kind == "fault"]
    expected = [*((t, codes.ESTOPPED) for t in stops), *((t, codes.RESET) for t in releases)]
    assert told == sorted(expected)


def test_a_stopped_robot_sinks_and_that_is_no_fall_but_one_after_its_release_is() -> None:
    server, listener = served(initial_posture="standing", duration=60.0)
    ask(server, PRESSED)
    for _ in range(2000):
        assert server.step({"r1": STAND}) is None
    told = [event.code for event in listener.events() if event.kind == "fault"]
    assert told == [codes.ESTOPPED, codes.LIES]
    assert server.plant.truth().base_pos[0, 2] < 0.15  # type: ignore[union-attr]
    ask(server, reset(server.plant.tick))
    up = 0.0
    while up < 0.27 and server.plant.tick < 6000:
        assert server.step({"r1": STAND}) is None
        up = server.plant.truth().base_pos[0, 2]  # type: ignore[union-attr]
    assert up >= 0.27, "stiff joints have got it up"
    ends = [server.step({}) for _ in range(6000)]
    assert [event.code for event in listener.events()][-1] == codes.FALL
    assert next(end for end in ends if end is not None).code == codes.FALLEN


@pytest.mark.parametrize("ends", [False, True])
def test_a_walk_that_is_to_be_over_is_once_the_team_has_had_time_to_stand(ends: bool) -> None:
    server, listener = served(initial_posture="standing")
    ask(server, NOBODY, [SafeStop(0, 0, "lunch", ends)])
    over = [server.step({"r1": STAND}) for _ in range(STOP_LINGER_MS + 2)]
    asked = [(e.tick, e.detail) for e in listener.events() if e.code == codes.STOP_ASKED]
    assert asked == [(1, "lunch; the walk ends" if ends else "lunch")]
    assert over[:STOP_LINGER_MS] == [None] * STOP_LINGER_MS
    assert over[STOP_LINGER_MS] == ((codes.STOPPED, "lunch") if ends else None)


def test_only_who_drives_time_ends_a_walk() -> None:
    config, listener = Config(), Listener()
    server = PlantServer(config, World(config, ("r2",)), cast("Bus", listener), "r2")
    ask(server, [SafeStop(0, 0, "lunch", True)])
    assert [server.step({"r2": STAND}) for _ in range(STOP_LINGER_MS + 9)][-1] is None
    assert not listener.events()
