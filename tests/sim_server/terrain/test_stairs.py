"""Stairs are as high, deep and many as the configuration says, and lie where the team walks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quadriga.shared.config.sections import ReferenceConfig
from quadriga.shared.robots.conventions import GRAVITY, Array
from quadriga.sim_server.terrain.ground import Stairs
from quadriga.sim_server.terrain.terrain import build_terrain
from quadriga.sim_server.world.team_model import formation
from quadriga.sim_server.world.world import World
from tests.a1 import TOTAL_MASS
from tests.sim_server.standing import configured, shift, stand


def laid(vx: float = 0.4, **world: object) -> Stairs:
    config = configured(3, terrain="stairs", seconds=30.0, **world)  # type: ignore[arg-type]
    config = replace(config, reference=ReferenceConfig(vx=vx))
    relief = build_terrain(config, formation(3, config.team.spacing)).relief
    assert isinstance(relief, Stairs)
    return relief


def profile(stairs: Stairs, y: float = 0.0) -> tuple[Array, Array]:
    """Positions 1 mm apart along the way, and the heights there."""
    x = np.arange(-10.0, 20.0, 1e-3)
    return x, stairs.height(x, np.full_like(x, y))


@pytest.mark.parametrize(("rise", "run", "count"), [(0.06, 0.3, 8), (0.1, 0.25, 3)])
def test_every_riser_is_upright_and_every_tread_level(rise: float, run: float, count: int) -> None:
    stairs = laid(stairs_rise=rise, stairs_run=run, stairs_count=count)
    x, z = profile(stairs)
    steps = np.diff(z)
    at = np.flatnonzero(steps)
    np.testing.assert_allclose(steps[at], [rise] * count + [-rise] * count, atol=1e-12)
    depths = np.diff(x[at])
    np.testing.assert_allclose(np.delete(depths, count - 1), run, atol=2e-3)
    assert 1.0 < depths[count - 1] < 2.0  # the landing
    assert stairs.top == pytest.approx(rise * count) == pytest.approx(z.max())


def test_the_seed_decides_where_they_begin_within_one_tread() -> None:
    begins = [laid(seed=seed).risers[0, 0] for seed in range(20)]
    assert begins[3] == laid(seed=3).risers[0, 0]
    assert 0.2 < np.ptp(begins) < 0.3


def test_they_lie_on_the_side_that_the_team_walks_to_and_end_beside_it() -> None:
    for vx in (0.4, -0.4):
        stairs = laid(vx)
        assert (np.sign(stairs.risers) == np.sign(vx)).all()
        right, left = stairs.sides
        assert right < -1.0
        assert left > 1.0
        assert not profile(stairs, left + 0.01)[1].any()


def test_a_team_stands_on_a_tread_as_high_as_it_is() -> None:
    world = World(configured(1, terrain="stairs", stairs_run=1.0, stairs_rise=0.1))
    risers = world.team.terrain.relief.risers  # type: ignore[attr-defined]
    third = risers[1, 0] + 1.5
    shift(world, dx=third, dz=0.31)
    stand(world, 500)
    truth = world.truth()
    assert world.fallen() == ()
    assert truth.grf[:, :, 2].sum() == pytest.approx(TOTAL_MASS * GRAVITY, rel=0.02)
    assert 0.3 + 0.23 < truth.base_pos[0, 2] < 0.3 + 0.27
