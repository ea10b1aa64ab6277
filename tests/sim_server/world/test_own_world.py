"""A robot in a world of its own stands where the team puts it and meets what was meant for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Truth
from quadriga.shared.robots.conventions import Array
from quadriga.sim_server.world.world import World
from tests.sim_server.standing import configured, stand

PUSHES = "r1:60:90:0.01:0.05,r2:60:0:0.02:0.05"


@pytest.fixture
def config() -> Config:
    return configured(
        3, yokes="none", noise=True, push=PUSHES, scatter=0.1, payload=2.0, payload_on="r2:1"
    )


def own(truth: Truth, robot: str) -> Array:
    place: Array = truth.base_pos[truth.robots.index(robot)]
    return place


def test_it_starts_at_its_place_with_its_own_noise(config: Config) -> None:
    together = World(config)
    for name in together.names:
        alone = World(config, (name,))
        assert alone.names == (name,)
        np.testing.assert_array_equal(own(alone.truth(), name), own(together.truth(), name))
        np.testing.assert_allclose(alone.states()[name].row, together.states()[name].row, atol=1e-9)


def test_it_moves_as_it_would_beside_the_others(config: Config) -> None:
    together, calm = World(config), World(replace(config, world=replace(config.world, push="")))
    alone = {name: World(config, (name,)) for name in together.names}
    stand(together, 100)
    stand(calm, 100)
    for name, world in alone.items():
        stand(world, 100)
        place = own(world.truth(), name)
        np.testing.assert_allclose(place, own(together.truth(), name), atol=1e-4)
        pushed = np.abs(place - own(calm.truth(), name)).max() > 1e-3
        assert pushed == (name in PUSHES)


def test_what_happens_to_others_is_none_of_its_events(config: Config) -> None:
    events = {
        name: [event for _ in range(100) for event in world.step({})]
        for name in ("r1", "r2", "r3")
        for world in [World(config, (name,))]
    }
    found = {name: [(e.kind, e.robot) for e in of] for name, of in events.items()}
    assert found["r1"] == [("start", ""), ("terrain", ""), ("push", "r1")]
    assert found["r2"] == [("start", ""), ("terrain", ""), ("payload", "r2"), ("push", "r2")]
    assert found["r3"] == [("start", ""), ("terrain", "")]


def test_yokes_are_those_between_the_robots_that_are_there() -> None:
    config = configured(3, yokes="chain")
    assert World(config, ("r2", "r3")).team.yokes == ((0, 1),)
    assert World(config, ("r1", "r3")).team.yokes == ()
