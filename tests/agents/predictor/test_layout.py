"""The layout that a team's predictor hands to the numerics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quadriga.agents.predictor.episode import U_SCALE, Y_SCALE, Layout, everyone, scales
from quadriga.agents.predictor.predictor import PredictorMeta
from quadriga.shared.config.sections import Config, TeamConfig

TEAM = PredictorMeta.of(Config(team=TeamConfig(robots=4)))


@pytest.mark.parametrize(
    ("yokes", "neighbours", "members"),
    [
        ("chain", "all", everyone(4)),
        ("complete", "yoked", everyone(4)),
        ("chain", "yoked", ((0, 1), (0, 1, 2), (1, 2, 3), (2, 3))),
        ("ring", "yoked", ((0, 1, 3), (0, 1, 2), (1, 2, 3), (0, 2, 3))),
        ("none", "yoked", ((0,), (1,), (2,), (3,))),
    ],
)
def test_members_are_the_robot_itself_and_whoever_explains_it(
    yokes: str, neighbours: str, members: tuple[tuple[int, ...], ...]
) -> None:
    layout = replace(TEAM, yokes=yokes, neighbours=neighbours).layout
    assert layout.members == members
    assert layout.strangers(0) == [j for j in range(4) if j not in members[0]]


def test_sizes_and_scales_are_the_team_s() -> None:
    layout = TEAM.layout
    assert (layout.agents, layout.width, layout.past) == (4, TEAM.width, TEAM.past)
    assert layout.rows == 6 * TEAM.N
    z_scale, y_scale = scales(layout)
    np.testing.assert_array_equal(z_scale[: 12 * TEAM.T_ini], U_SCALE)
    np.testing.assert_array_equal(
        z_scale[12 * TEAM.T_ini : TEAM.past], np.tile(Y_SCALE, TEAM.T_ini)
    )
    np.testing.assert_array_equal(z_scale[TEAM.past :], U_SCALE)
    np.testing.assert_array_equal(y_scale, np.tile(Y_SCALE, TEAM.N))


def test_the_scales_of_any_plant_repeat_for_every_sample() -> None:
    layout = Layout(1, 2, 1, 2, 3, (1.0, 10.0), (5.0,), everyone(1))
    z_scale, y_scale = scales(layout)
    assert z_scale.tolist() == [1, 10, 1, 10, 5, 5, 1, 10, 1, 10, 1, 10]
    assert y_scale.tolist() == [5, 5, 5]
    assert (layout.past, layout.width, layout.rows) == (6, 12, 3)
