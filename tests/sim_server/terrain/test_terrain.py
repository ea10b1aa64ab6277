from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from quadriga.shared.config.reference_trace import inline_trace, trace_of
from quadriga.shared.config.sections import Config, ReferenceConfig
from quadriga.shared.robots.conventions import Array
from quadriga.sim_server.terrain.ground import HeightField
from quadriga.sim_server.terrain.relief import build_course
from quadriga.sim_server.terrain.terrain import Terrain, build_terrain
from quadriga.sim_server.world.team_model import build_team_model, formation
from tests.sim_server.standing import configured

KINDS = ("boxes", "gravel", "heightfield", "slope")
FIXED = (*KINDS, "stairs")
HEIGHT = 0.06


def laid(kind: str, *, n: int = 3, seed: int = 0, **reference: Any) -> tuple[Config, Terrain]:
    config = configured(n, terrain=kind, terrain_height=HEIGHT, seed=seed, seconds=8.0)
    config = replace(config, reference=ReferenceConfig(**reference))
    return config, build_terrain(config, formation(n, config.team.spacing))


def points(low: float, high: float, count: int) -> tuple[Array, Array]:
    """Random points with x between the limits and |y| ≤ 2 m."""
    random = np.random.default_rng(0)
    return random.uniform(low, high, count), random.uniform(-2.0, 2.0, count)


@pytest.mark.parametrize("kind", FIXED)
@pytest.mark.parametrize("n", [1, 3, 10])
def test_ground_is_flat_around_the_spawned_team(kind: str, n: int) -> None:
    config, terrain = laid(kind, n=n)
    places = formation(n, config.team.spacing)
    low, high = places.min(axis=0) - 0.4 - 0.2, places.max(axis=0) + 0.4 + 0.2
    x, y = np.meshgrid(np.linspace(low[0], high[0] + 0.1, 80), np.linspace(low[1], high[1], 80))
    assert not terrain.height(x, y).any()


@pytest.mark.parametrize("kind", KINDS)
def test_terrain_fills_the_way_up_to_its_height(kind: str) -> None:
    _, terrain = laid(kind, vx=0.5)
    x, y = np.meshgrid(np.linspace(1.5, 6.0, 200), np.linspace(-1.0, 1.0, 200))
    z = terrain.height(x, y)
    assert z.min() >= 0.0
    assert z.max() <= terrain.top <= HEIGHT + 1e-12
    assert z.max() > 0.7 * HEIGHT
    assert np.mean(z > 0.1 * HEIGHT) > 0.3
    assert z[:, :100].std() > 0.1 * HEIGHT
    assert z[:, 100:].std() > 0.1 * HEIGHT


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


@pytest.mark.parametrize("kind", KINDS)
def test_seed_decides_the_terrain(kind: str) -> None:
    x, y = points(1.5, 5.0, 500)
    first, again, other = (laid(kind, seed=seed)[1].height(x, y) for seed in (7, 7, 8))
    np.testing.assert_array_equal(first, again)
    assert np.mean(first != other) > 0.2


@pytest.mark.parametrize("kind", FIXED)
def test_terrain_does_not_depend_on_what_else_is_random(kind: str) -> None:
    config, terrain = laid(kind)
    x, y = points(1.5, 5.0, 200)
    loud = replace(config, sensors=replace(config.sensors, gyro=1.0))
    same = build_terrain(loud, formation(3, config.team.spacing))
    np.testing.assert_array_equal(terrain.height(x, y), same.height(x, y))


def test_smooth_field_is_smooth_at_the_scale_of_a_foot() -> None:
    _, terrain = laid("heightfield")
    x = np.linspace(2.0, 6.0, 4001)
    slope = np.diff(terrain.height(x, np.zeros_like(x))) / np.diff(x)
    assert np.abs(slope).max() < 0.6
    _, gravel = laid("gravel")
    rough = np.diff(gravel.height(x, np.zeros_like(x))) / np.diff(x)
    assert rough.std() > 3.0 * slope.std()


@pytest.mark.parametrize(
    ("vx", "vy", "wz"), [(0.5, 0.0, 0.0), (-0.5, 0.0, 0.0), (0.4, 0.2, 0.0), (0.5, 0.0, 0.3)]
)
def test_course_contains_the_nominal_way(vx: float, vy: float, wz: float) -> None:
    config, _ = laid("flat", vx=vx, vy=vy, wz=wz)
    config = replace(config, world=replace(config.world, duration=20.0))
    places = formation(3, config.team.spacing)
    course = build_course(config, places)
    yaw, at = 0.0, places.mean(axis=0)
    for _ in range(2000):
        at = at + 1e-2 * np.array(
            [vx * np.cos(yaw) - vy * np.sin(yaw), vx * np.sin(yaw) + vy * np.cos(yaw)]
        )
        yaw += 1e-2 * wz
        assert course.extent.depth(at[0], at[1]) > 1.0
    assert bool(course.needs(at[0], at[1]))
    if not wz:
        end = at + 2.5 * np.array([vx, vy]) / np.hypot(vx, vy)
        assert course.extent.depth(end[0], end[1]) > 0.0


@pytest.mark.parametrize(("vx", "seconds"), [(1.2, 120.0), (-0.3, 120.0), (0.3, 200.0)])
def test_terrain_follows_a_trace_and_not_the_speed_it_replaces(
    vx: float, seconds: float, tmp_path: Path
) -> None:
    trace = tmp_path / "trace.csv"
    trace.write_text(f"t,vx,vy,wz\n0,{vx},0,0\n10,{vx},0,0\n", encoding="utf-8")
    for asked in (1.0, 0.0):
        config, _ = laid("flat", vx=asked)
        config = replace(
            config,
            world=replace(config.world, duration=seconds),
            reference=replace(config.reference, trace=inline_trace(trace)),
        )
        places = formation(3, config.team.spacing)
        course = build_course(config, places)
        reach = min(40.0, abs(vx) * seconds)
        longest = np.abs([course.extent.x_low, course.extent.x_high]).max()
        assert reach + 2.0 < longest < reach + 7.0
        assert (course.extent.x_low < -reach) == (vx < 0.0)
        before = course.flat.x_high - places[:, 0].max()
        behind = places[:, 0].min() - course.flat.x_low
        assert (before > behind) == (vx > 0.0)


def test_a_very_long_way_is_covered_to_a_bound_only() -> None:
    config, _ = laid("flat", vx=0.5)
    config = replace(config, world=replace(config.world, duration=3600.0))
    extent = build_course(config, formation(1, 0.9)).extent
    assert 40.0 < extent.x_high < 50.0


@pytest.mark.parametrize("slope", [4.0, 8.0, 15.0])
def test_ramps_are_as_steep_as_they_are_said_to_be(slope: float) -> None:
    config = configured(3, terrain="slope", terrain_height=0.3, slope=slope, seconds=20.0)
    terrain = build_terrain(config, formation(3, 0.9))
    x = np.arange(1.0, 9.0, 0.05)
    z = np.array([terrain.height(x, np.full_like(x, y)) for y in (-0.05, 0.05)])
    grade = np.hypot(np.diff(z, axis=1)[0] / 0.05, (z[1] - z[0])[1:] / 0.1)
    steep = np.tan(np.radians(slope))
    assert np.median(grade) == pytest.approx(steep, rel=0.02)
    assert grade.max() < 1.02 * steep
    assert {1.0, -1.0} <= set(np.sign(np.diff(z[0]).round(6)))  # up and down
    assert 0.15 < terrain.top <= 0.3


def test_a_trace_leads_over_the_terrain() -> None:
    config = configured(1, terrain="boxes", seconds=30.0)
    config = replace(config, reference=ReferenceConfig(trace="joystick.csv"))
    way = build_course(config, formation(1, 0.9)).way
    trace = trace_of(config)
    assert trace is not None
    yaw, at = 0.0, np.zeros(2)
    for k in range(3000):
        vx, vy, wz = trace.at(1e-2 * k)
        yaw += 1e-2 * wz
        turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
        at = at + 1e-2 * turn @ (vx, vy)
        assert np.linalg.norm(way - at, axis=1).min() < 0.1
    assert np.linalg.norm(at) > 3.0


def test_height_field_shows_the_plane_outside_and_below() -> None:
    _, terrain = laid("heightfield")
    assert isinstance(terrain.relief, HeightField)
    assert terrain.height(np.array([1e3, -1e3]), np.array([0.0, 0.0])).tolist() == [0.0, 0.0]
    assert terrain.relief.z.min() < 0.0
