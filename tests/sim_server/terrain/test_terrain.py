"""Every row of the table of terrains, by the one interface; and where terrain is laid."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from quadriga.shared.config.reference_trace import inline_trace
from quadriga.shared.config.sections import Config, ReferenceConfig
from quadriga.shared.config.terrains import TERRAINS
from quadriga.shared.robots.conventions import GRAVITY, Array
from quadriga.sim_server.terrain.ground import BoxTerrain, HeightField
from quadriga.sim_server.terrain.terrain import Course, Terrain, build_course
from quadriga.sim_server.world.scenario import build_loads, build_scenario
from quadriga.sim_server.world.team_model import build_team_model, build_terrain, formation
from quadriga.sim_server.world.world import World
from tests.a1 import TOTAL_MASS
from tests.sim_server.standing import configured, shift, stand

KINDS = ("boxes", "gravel", "heightfield", "slope")
FIXED = (*KINDS, "stairs")
HEIGHT = 0.06


def laid(kind: str, *, n: int = 3, seed: int = 0, **world: Any) -> tuple[Config, Terrain]:
    world = {"terrain_height": HEIGHT, "duration": 8.0} | world
    config = configured(n, terrain=kind, seed=seed, **world)
    return config, build_terrain(config)


def course_of(n: int, duration: float, **reference: Any) -> Course:
    config = configured(n, duration=duration)
    config = replace(config, reference=ReferenceConfig(**reference))
    return build_course(config, formation(n, config.team.spacing))


def points(low: float, high: float, count: int) -> tuple[Array, Array]:
    """Random points with x between the limits and |y| ≤ 2 m."""
    random = np.random.default_rng(0)
    return random.uniform(low, high, count), random.uniform(-2.0, 2.0, count)


@pytest.mark.parametrize("kind", TERRAINS)
def test_every_row_is_built_announced_and_stood_on(kind: str) -> None:
    """The stairs have one step; everywhere else the ground is up to 2 cm high."""
    row, keys = TERRAINS[kind], {"terrain_height": 0.02, "stairs_count": 1, "seed": 4}
    config = configured(terrain=kind, duration=8.0, **keys)  # type: ignore[arg-type]
    detail = build_scenario(config, build_loads(config)).events[1].detail
    assert detail.startswith(kind)
    assert (", seed 4" in detail) == (kind != "flat")
    flat = build_terrain(configured(terrain=kind, **{row.height_key: 0.0}))  # type: ignore[arg-type]
    assert type(flat) is Terrain
    world = World(config)
    terrain = world.team.terrain
    assert (type(terrain) is Terrain) is (kind == "flat")
    assert (world._moving is not None) == terrain.loose == (kind == "pebbles")
    shift(world, dx=2.0, dz=terrain.top + 0.03)
    stand(world, 400)
    assert world.fallen() == ()
    truth, weight = world.truth(), config.team.robots * TOTAL_MASS * GRAVITY
    assert truth.grf[:, :, 2].sum() == pytest.approx(weight, rel=0.02)
    height = truth.base_pos[0, 2]
    assert 0.23 + (0.06 if kind == "stairs" else 0.0) < height < 0.29 + terrain.top
    stones = terrain.stones_near(np.array([2.0, 0.0]), 2000)
    assert (len(stones.poses) > 0) == terrain.loose
    assert len(stones.poses) == len(stones.halves) == len(stones.colours)


@pytest.mark.parametrize("kind", FIXED)
@pytest.mark.parametrize("n", [1, 10])
def test_ground_is_flat_around_the_spawned_team(kind: str, n: int) -> None:
    config, terrain = laid(kind, n=n)
    places = formation(n, config.team.spacing)
    low, high = places.min(axis=0) - 0.4 - 0.2, places.max(axis=0) + 0.4 + 0.2
    x, y = np.meshgrid(np.linspace(low[0], high[0] + 0.1, 80), np.linspace(low[1], high[1], 80))
    assert not terrain.height(x, y).any()


@pytest.mark.parametrize("kind", KINDS)
def test_terrain_fills_the_way_up_to_its_height_as_the_seed_decides(kind: str) -> None:
    terrain, again, other = (laid(kind, seed=seed)[1] for seed in (7, 7, 8))
    x, y = np.meshgrid(np.linspace(1.5, 5.0, 200), np.linspace(-1.0, 1.0, 200))
    z = terrain.height(x, y)
    assert z.min() >= 0.0
    assert 0.7 * HEIGHT < z.max() <= terrain.top <= HEIGHT + 1e-12
    assert np.mean(z > 0.1 * HEIGHT) > 0.3
    assert z[:, :100].std() > 0.1 * HEIGHT
    assert z[:, 100:].std() > 0.1 * HEIGHT
    np.testing.assert_array_equal(z, again.height(x, y))
    assert np.mean(z != other.height(x, y)) > 0.2


@pytest.mark.parametrize("kind", FIXED)
def test_height_is_where_a_ray_from_above_meets_the_model(kind: str) -> None:
    config, terrain = laid(kind)
    model = build_team_model(config).model
    d = mujoco.MjData(model)
    d.qpos[2::19] = 50.0  # the robots out of the way
    mujoco.mj_forward(model, d)
    x, y = points(-3.0, 8.0, 400)
    down, geom, normal = np.array([0.0, 0.0, -1.0]), np.zeros(1, dtype=np.int32), np.zeros(3)
    for px, py, z in zip(x, y, terrain.height(x, y), strict=True):
        eye = np.array([px, py, 1.0])
        distance = mujoco.mj_ray(model, d, eye, down, None, 1, -1, geom, normal)
        assert 1.0 - distance == pytest.approx(z, abs=1e-6)


def test_smooth_field_is_smooth_at_the_scale_of_a_foot_and_the_plane_outside_and_below() -> None:
    smooth, gravel = laid("heightfield")[1], laid("gravel")[1]
    x = np.linspace(2.0, 6.0, 4001)
    slope, rough = (np.diff(t.height(x, np.zeros_like(x))) / 1e-3 for t in (smooth, gravel))
    assert np.abs(slope).max() < 0.6
    assert rough.std() > 3.0 * slope.std()
    assert isinstance(smooth, HeightField)
    assert smooth.height(np.array([1e3, -1e3]), np.zeros(2)).tolist() == [0.0, 0.0]
    assert smooth.z.min() < 0.0


@pytest.mark.parametrize("slope", [4.0, 15.0])
def test_ramps_are_as_steep_as_they_are_said_to_be(slope: float) -> None:
    _, terrain = laid("slope", terrain_height=0.3, slope=slope, duration=20.0)
    x = np.arange(1.0, 9.0, 0.05)
    z = np.array([terrain.height(x, np.full_like(x, y)) for y in (-0.05, 0.05)])
    grade = np.hypot(np.diff(z, axis=1)[0] / 0.05, (z[1] - z[0])[1:] / 0.1)
    steep = np.tan(np.radians(slope))
    assert np.median(grade) == pytest.approx(steep, rel=0.02)
    assert grade.max() < 1.02 * steep
    assert {1.0, -1.0} <= set(np.sign(np.diff(z[0]).round(6)))  # up and down
    assert 0.15 < terrain.top <= 0.3


@pytest.mark.parametrize(
    ("vx", "rise", "run", "count"), [(0.4, 0.06, 0.3, 8), (-0.4, 0.1, 0.25, 3)]
)
def test_stairs_have_upright_risers_and_level_treads_on_the_side_that_the_team_walks_to(
    vx: float, rise: float, run: float, count: int
) -> None:
    keys = {"stairs_rise": rise, "stairs_run": run, "stairs_count": count, "duration": 30.0}
    begins = []
    for seed in range(20):
        config = configured(3, terrain="stairs", seed=seed, **keys)  # type: ignore[arg-type]
        built = build_terrain(replace(config, reference=ReferenceConfig(vx=vx)))
        assert isinstance(built, BoxTerrain)
        stairs = built
        begins.append(stairs.centre[0, 0] - stairs.half[0, 0])
    x = np.arange(-10.0, 20.0, 1e-3)
    z = stairs.height(x, np.zeros_like(x))
    steps, right, left = np.diff(z), *(stairs.centre[0, 1] + s * stairs.half[0, 1] for s in (-1, 1))
    at = np.flatnonzero(steps)
    np.testing.assert_allclose(steps[at], [rise] * count + [-rise] * count, atol=1e-12)
    depths = np.diff(x[at])
    np.testing.assert_allclose(np.delete(depths, count - 1), run, atol=2e-3)
    assert 1.0 < depths[count - 1] < 2.0  # the landing
    assert stairs.top == pytest.approx(rise * count) == pytest.approx(z.max())
    assert (np.sign(x[at]) == np.sign(vx)).all()
    assert right < -1.0 < 1.0 < left
    assert not stairs.height(x, np.full_like(x, left + 0.01)).any()
    assert 0.6 * run < np.ptp(begins) < run, "the seed decides, within one tread"


@pytest.mark.parametrize(
    ("vx", "vy", "wz"), [(0.5, 0.0, 0.0), (-0.5, 0.0, 0.0), (0.4, 0.2, 0.0), (0.5, 0.0, 0.3)]
)
def test_course_contains_the_nominal_way(vx: float, vy: float, wz: float) -> None:
    course = course_of(3, 20.0, vx=vx, vy=vy, wz=wz)
    yaw, at = 0.0, formation(3, 0.9).mean(axis=0)
    for _ in range(2000):
        c, s = np.cos(yaw), np.sin(yaw)
        at = at + 1e-2 * np.array([vx * c - vy * s, vx * s + vy * c])
        yaw += 1e-2 * wz
        assert course.extent.depth(at[0], at[1]) > 1.0
    assert bool(course.needs(at[0], at[1]))
    if not wz:
        end = at + 2.5 * np.array([vx, vy]) / np.hypot(vx, vy)
        assert course.extent.depth(end[0], end[1]) > 0.0


@pytest.mark.parametrize(("vx", "seconds"), [(1.2, 120.0), (-0.3, 120.0), (0.3, 200.0)])
def test_terrain_follows_a_trace_and_not_the_speed_it_replaces_up_to_40_m(
    vx: float, seconds: float, tmp_path: Path
) -> None:
    trace = tmp_path / "trace.csv"
    trace.write_text(f"t,vx,vy,wz\n0,{vx},0,0\n10,{vx},0,0\n", encoding="utf-8")
    places = formation(3, 0.9)
    for asked in (1.0, 0.0):
        course = course_of(3, seconds, vx=asked, trace=inline_trace(str(trace)))
        reach = min(40.0, abs(vx) * seconds)
        longest = np.abs([course.extent.x_low, course.extent.x_high]).max()
        assert reach + 2.0 < longest < reach + 7.0
        assert (course.extent.x_low < -reach) == (vx < 0.0)
        before = course.flat.x_high - places[:, 0].max()
        behind = places[:, 0].min() - course.flat.x_low
        assert (before > behind) == (vx > 0.0)
    assert 40.0 < course_of(1, 3600.0, vx=0.5).extent.x_high < 50.0
