"""Stones lie still until a foot comes, then they are bodies like any other."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from quadriga.pictures.mujoco_frames import add_stones
from quadriga.shared.codec import encode
from quadriga.shared.robots.conventions import GRAVITY, N_LEGS, Array
from quadriga.sim_server.terrain.pebbles import LooseStones, Pebbles
from quadriga.sim_server.world.world import World
from tests.a1 import TOTAL_MASS
from tests.sim_server.standing import configured, shift, stand


def strewn(robots: int = 1, **world: object) -> World:
    """A world whose team hangs just above the stones."""
    keys = {"terrain": "pebbles", "terrain_height": 0.02, "duration": 8.0} | world
    made = World(configured(robots, **keys))  # type: ignore[arg-type]
    shift(made, dx=3.0, dz=0.03)
    return made


def parts(world: World) -> tuple[Pebbles, LooseStones]:
    pebbles, stones = world.team.terrain, world._moving
    assert isinstance(pebbles, Pebbles)
    assert isinstance(stones, LooseStones)
    return pebbles, stones


def places(stones: LooseStones) -> Array:
    """Where every stone is now."""
    pose = stones.pose.copy()
    awake = stones.stone_of >= 0
    pose[stones.stone_of[awake]] = stones._q[awake]
    return pose


def test_stones_cover_the_way_and_do_not_overlap() -> None:
    pebbles, _ = parts(strewn(3))
    x, y = pebbles.pose[:, 0], pebbles.pose[:, 1]
    ahead = (x > 1.5) & (x < 3.0) & (np.abs(y) < 0.4)
    area = np.pi * pebbles.half[:, 0] * pebbles.half[:, 1]
    assert 0.15 < area[pebbles.size[ahead]].sum() / (1.5 * 0.8) < 0.5
    near = pebbles.pose[ahead][:, :2]
    gaps = np.linalg.norm(near[:, None] - near, axis=-1)
    reach = pebbles.half[pebbles.size[ahead], 0]
    np.fill_diagonal(gaps, np.inf)
    assert (gaps > reach[:, None] + reach - 1e-9).all()
    assert pebbles.half[:, 2].max() == pytest.approx(0.01)
    flat = (x > -0.6) & (x < 0.7) & (np.abs(y) < 0.8)
    assert not flat.any()


def test_a_team_on_stones_is_carried_by_them_and_equal_seeds_give_equal_bytes() -> None:
    world, again, other = strewn(), strewn(), strewn(seed=4)
    for each in (world, again, other):
        stand(each, 600)
    assert encode(world.truth()) == encode(again.truth()) != encode(other.truth())
    team = strewn(3)
    stand(team, 400)
    assert parts(team)[1].without == 0, "there is a body for every stone that a foot comes near"
    truth, (pebbles, stones) = world.truth(), parts(world)
    assert world.fallen() == ()
    assert truth.grf[:, :, 2].sum() == pytest.approx(TOTAL_MASS * GRAVITY, rel=0.02)
    assert truth.base_pos[0, 2] > 0.2625  # on the stones; on the plane it is 0.26 at most
    assert np.abs(stones._v[:, :3]).max() < 0.02
    pressed = 0.5 * pebbles.half[pebbles.size, 2] - places(stones)[:, 2]
    assert pressed.max() < 0.0  # none has been pressed into the ground


def test_stones_give_way_under_feet_that_slide_over_them_and_the_others_stay() -> None:
    world = strewn(push_force=0.0, push="r1:90:90:0.5:0.3")
    pebbles, stones = parts(world)
    stand(world, 1000)
    moved = np.linalg.norm(places(stones)[:, :2] - pebbles.pose[:, :2], axis=1)
    assert 3 <= (moved > 2e-3).sum() <= 60
    assert moved.max() < 0.5
    feet = world.physics.geom_xpos[world._feet, :2]
    far = np.linalg.norm(pebbles.pose[:, None, :2] - feet, axis=-1).min(axis=1) > 0.5
    np.testing.assert_array_equal(places(stones)[far], pebbles.pose[far])


def test_stones_are_left_where_they_lie_and_found_there_again() -> None:
    world = strewn()
    stones = parts(world)[1]
    stand(world, 600)
    awake = stones.stone_of[stones.stone_of >= 0]
    assert 4 <= len(awake) <= 2 * 8 * N_LEGS
    left = places(stones)[awake]
    shift(world, dz=1.0)
    stand(world, 40)
    assert (stones.stone_of < 0).all()
    np.testing.assert_allclose(stones.pose[awake], left, atol=2e-3)
    assert stones._q[:, 2].min() > 400.0  # their bodies wait where nobody is …
    before = stones._q.copy()
    stand(world, 100)
    np.testing.assert_array_equal(stones._q, before)  # … and do not fall


def test_friction_and_stiffness_are_those_of_the_stones() -> None:
    world = strewn(friction=0.35)
    stand(world, 300)
    contact = world.physics.contact
    stone = world.team.model.geom_priority[contact.geom].max(axis=1) == 2
    assert stone.sum() > 10
    np.testing.assert_allclose(contact.friction[:, 0], 0.35)
    np.testing.assert_allclose(contact.solref[stone, 0], 0.004)
    feet = np.isin(contact.geom, world._feet).any(axis=1)
    assert (stone & feet).any()
    kinds = world.team.model.geom_type[contact.geom[stone & ~feet]]
    assert (kinds == mujoco.mjtGeom.mjGEOM_ELLIPSOID).any(axis=1).all()


@pytest.mark.parametrize("room", [5000, 40])
def test_the_stones_around_a_place_are_drawn_the_nearest_first(room: int) -> None:
    pebbles, model = parts(strewn())[0], strewn().team.model
    scene = mujoco.MjvScene(model, maxgeom=room)
    centre = np.array([2.0, 0.1])
    stones = pebbles.stones_near(centre, room, 0.5)
    add_stones(scene, stones)
    away = np.sort(np.linalg.norm(pebbles.pose[:, :2] - centre, axis=1))
    count = min(room, int((away <= 0.5).sum()))
    drawn = np.array([scene.geoms[i].pos for i in range(scene.ngeom)])
    assert len(drawn) == count > 10
    np.testing.assert_allclose(
        np.linalg.norm(drawn[:, :2] - centre, axis=1), away[:count], atol=1e-6
    )
    np.testing.assert_allclose(
        [scene.geoms[i].size for i in range(count)], stones.halves, rtol=1e-6
    )
    assert (stones.poses[:, 2] == stones.halves[:, 2]).all(), "each lies on the ground"
