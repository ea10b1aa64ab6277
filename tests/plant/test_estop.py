"""The plant obeys the emergency stop itself: from the next tick on every joint is damped."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest

from quadriga.plant.commands import MOTOR_DAMPING
from quadriga.plant.requests import NO_REQUESTS, Requests
from quadriga.plant.server import STOP_LINGER_MS, PlantServer
from quadriga.plant.team_time import FollowerTime
from quadriga.shared import codes
from quadriga.shared.bus.session import Bus
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Reset, SafeStop
from quadriga.sim_server.world.world import World
from tests.plant.test_server import Listener, served
from tests.sim_server.standing import STAND


def ask(server: PlantServer, *requests: Requests) -> None:
    """Have people ask for something at each of the next ticks, and nothing after."""
    asked = iter(requests)
    server.requests = lambda: next(asked, NO_REQUESTS)


def test_whatever_agents_command_after_it_the_joints_are_damped() -> None:
    server, listener = served(initial_posture="standing")
    for _ in range(50):
        server.step({"r1": STAND})
    ask(server, Requests("operator: dog"))
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
    server = PlantServer(config, world, cast("Bus", listener), FollowerTime(config))
    server.requests = lambda: Requests("now")
    server.step({"r2": STAND})
    assert [e.robot for e in listener.events() if e.code == codes.ESTOPPED] == ["r2"]


RELEASE = Reset(0, 0, "ann")


def test_only_its_release_ends_it_and_not_one_of_the_same_tick() -> None:
    server, listener = served(initial_posture="standing")
    torques = []
    later = Requests(reset=Reset(2, 0, "ann"))
    ask(server, Requests("dog", reset=RELEASE), NO_REQUESTS, later)
    for _ in range(4):
        v_joint = server.plant.states()["r1"].v_joint
        server.step({"r1": STAND})
        tau = server.plant.states()["r1"].tau_joint
        torques.append(np.allclose(tau, -MOTOR_DAMPING * v_joint, atol=1e-12))
    assert torques == [True, True, False, False]
    told = [(e.tick, e.code) for e in listener.events() if e.kind == "fault"]
    assert told == [(0, codes.ESTOPPED), (2, codes.RESET)]


def test_a_release_that_comes_twice_ends_no_stop_that_was_pressed_meanwhile() -> None:
    server, listener = served(initial_posture="standing")
    release = Requests(reset=RELEASE)
    ask(
        server,
        Requests("dog"),
        release,
        Requests("cat"),
        release,
        Requests(reset=Reset(9, 0, "bob")),
    )
    for _ in range(5):
        server.step({"r1": STAND})
    told = [(e.tick, e.code) for e in listener.events() if e.kind == "fault"]
    assert told == [(0, codes.ESTOPPED), (1, codes.RESET), (2, codes.ESTOPPED), (4, codes.RESET)]


def test_a_release_that_was_said_before_a_stop_does_not_end_it() -> None:
    server, listener = served(initial_posture="standing")
    ask(
        server,
        NO_REQUESTS,
        Requests("dog"),
        Requests(reset=RELEASE),
        Requests(reset=Reset(1, 0, "ann")),
    )
    for _ in range(4):
        server.step({"r1": STAND})
    told = [(e.tick, e.code) for e in listener.events() if e.kind == "fault"]
    assert told == [(1, codes.ESTOPPED), (3, codes.RESET)]


def test_whoever_presses_it_again_gets_an_answer_though_not_with_every_tick() -> None:
    server, listener = served(initial_posture="standing")
    server.requests = lambda: Requests("dog")
    for _ in range(250):
        server.step({"r1": STAND})
    stops = [event.tick for event in listener.events() if event.code == codes.ESTOPPED]
    assert stops == [0, 100, 200]


def test_a_stopped_robot_sinks_and_that_is_no_fall_but_one_after_its_release_is() -> None:
    server, listener = served(initial_posture="standing", duration=60.0)
    ask(server, Requests("dog"))
    for _ in range(2000):
        assert server.step({"r1": STAND}) is None
    told = [event.code for event in listener.events() if event.kind == "fault"]
    assert told == [codes.ESTOPPED, codes.LIES]
    assert server.plant.truth().base_pos[0, 2] < 0.15  # type: ignore[union-attr]
    ask(server, Requests(reset=Reset(server.plant.tick, 0, "ann")))
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
    ask(server, NO_REQUESTS, Requests(stop=SafeStop(0, 0, "lunch", ends)))
    over = [server.step({"r1": STAND}) for _ in range(STOP_LINGER_MS + 2)]
    asked = [(e.tick, e.detail) for e in listener.events() if e.code == codes.STOP_ASKED]
    assert asked == [(1, "lunch; the walk ends" if ends else "lunch")]
    assert over[:STOP_LINGER_MS] == [None] * STOP_LINGER_MS
    assert over[STOP_LINGER_MS] == ((codes.STOPPED, "lunch") if ends else None)


def test_only_who_drives_time_ends_a_walk() -> None:
    config, listener = Config(), Listener()
    server = PlantServer(
        config, World(config, ("r2",)), cast("Bus", listener), FollowerTime(config)
    )
    ask(server, Requests(stop=SafeStop(0, 0, "lunch", True)))
    assert [server.step({"r2": STAND}) for _ in range(STOP_LINGER_MS + 9)][-1] is None
    assert not listener.events()
