"""Poses of links: those of the whole world, and by hand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quadriga.pictures.poses import PosedTeam
from quadriga.shared.config.load import load
from quadriga.view.skeleton import Skeleton, rotate


@pytest.mark.parametrize("kind", ["a1", "go2"])
def test_links_are_where_the_world_has_them(kind: str) -> None:
    config = load(None, {"team.robots": 2, "team.robot": kind})
    random = np.random.default_rng(2)
    trunk = random.uniform(-1.0, 1.0, (2, 7))
    trunk[:, 3:] /= np.linalg.norm(trunk[:, 3:], axis=1, keepdims=True)
    q_joint = config.robot.q_stand + random.uniform(-0.3, 0.3, (2, 12))
    skeleton = Skeleton(config.robot, 2)
    posed = PosedTeam(config)
    posed.set(np.concatenate([trunk, q_joint], axis=1).ravel())
    places, quats = skeleton.pose(trunk, q_joint)
    assert skeleton.links[0] == "trunk"
    assert places[:, skeleton.feet] == pytest.approx(posed.feet())
    for i, robot in enumerate(("r1", "r2")):
        for k, link in enumerate(skeleton.links):
            assert places[i, k] == pytest.approx(posed.physics.body(f"{robot}/{link}").xpos)
            assert quats[i, k] == pytest.approx(posed.physics.body(f"{robot}/{link}").xquat)


def test_a_robot_that_stands_has_its_feet_under_its_hips() -> None:
    robot = load(None, {}).robot
    skeleton = Skeleton(robot, 1)
    upright = np.array([[0.0, 0.0, robot.stand_height, 1.0, 0.0, 0.0, 0.0]])
    feet = skeleton.pose(upright, robot.q_stand[None]).positions[0, skeleton.feet]
    assert feet[:, :2] == pytest.approx(robot.feet_under_hips, abs=1e-6)
    assert feet[:, 2] == pytest.approx(robot.geometry.foot_radius, abs=1e-6)


def test_vectors_turn_as_by_the_matrix() -> None:
    random = np.random.default_rng(3)
    quat = random.standard_normal((5, 4))
    quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    vector = random.standard_normal((5, 3))
    turned = Rotation.from_quat(np.roll(quat, -1, axis=1)).apply(vector)
    assert rotate(quat, vector) == pytest.approx(turned)
