"""Every row of the table of terrains is built, stood on and shown by the one interface."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.shared.config.terrains import TERRAINS
from quadriga.sim_server.terrain.relief import Relief
from quadriga.sim_server.terrain.terrain import build_terrain
from quadriga.sim_server.world.scenario import build_loads, build_scenario
from quadriga.sim_server.world.team_model import formation
from quadriga.sim_server.world.world import World
from tests.sim_server.standing import configured, shift, stand

KINDS = tuple(TERRAINS)


@pytest.mark.parametrize("kind", KINDS)
def test_a_terrain_is_built_by_its_row_and_a_plane_without_height(kind: str) -> None:
    row = TERRAINS[kind]
    relief = build_terrain(configured(terrain=kind), formation(1, 0.9)).relief
    assert isinstance(relief, Relief)
    assert (type(relief) is Relief) is (kind == "flat")
    low = configured(terrain=kind, **{row.height_key: 0.0})  # type: ignore[arg-type]
    plane = build_terrain(low, formation(1, 0.9)).relief
    assert type(plane) is Relief
    assert plane.top == 0.0


@pytest.mark.parametrize("kind", KINDS)
def test_a_terrain_is_announced_with_the_keys_that_shape_it(kind: str) -> None:
    config = configured(terrain=kind, terrain_height=0.07, stairs_rise=0.05, slope=9.0, seed=4)
    detail = build_scenario(config, build_loads(config)).events[1].detail
    assert detail.startswith(kind)
    assert "{" not in detail
    assert (", seed 4" in detail) == (kind != "flat")
    assert ("0.07" in detail) == (TERRAINS[kind].height_key == "terrain_height" and kind != "flat")


@pytest.mark.parametrize("kind", KINDS)
def test_a_robot_stands_on_every_terrain_and_loose_stones_are_told(kind: str) -> None:
    """The stairs have one step; everywhere else the ground is up to 2 cm high."""
    world = World(configured(terrain=kind, seconds=8.0, terrain_height=0.02, stairs_count=1))
    relief = world.team.terrain.relief
    assert (world._moving is not None) == relief.loose == (kind == "pebbles")
    shift(world, dx=2.0, dz=relief.top + 0.03)
    stand(world, 400)
    assert world.fallen() == ()
    height = world.truth().base_pos[0, 2]
    assert 0.23 + (0.06 if kind == "stairs" else 0.0) < height < 0.29 + relief.top
    stones = relief.stones_near(np.array([2.0, 0.0]), 2000)
    assert (len(stones.poses) > 0) == relief.loose
    assert len(stones.poses) == len(stones.halves) == len(stones.colours)
