"""Names stand over the robots that they name: points are where MuJoCo's camera shows them."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest
from PIL import Image

from quadriga.pictures.frames import FRAME
from quadriga.pictures.name_tags import write_names
from quadriga.pictures.viewpoint import AZIMUTH, ELEVATION, FIELD, Viewpoint
from quadriga.shared.robots.colours import robot_rgb

VIEW = Viewpoint(np.array([0.5, -0.2, 0.15]), 2.2)


def mujoco_camera() -> Any:
    """The camera of a MuJoCo scene that looks from the viewpoint."""
    model = mujoco.MjSpec().compile()
    model.vis.global_.fovy = FIELD
    data, camera = mujoco.MjData(model), mujoco.MjvCamera()
    camera.azimuth, camera.elevation = AZIMUTH, ELEVATION
    camera.lookat[:], camera.distance = VIEW.target, VIEW.distance
    scene = mujoco.MjvScene(model, maxgeom=10)
    everything = mujoco.mjtCatBit.mjCAT_ALL
    mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, camera, everything, scene)
    return mujoco.mjv_averageCamera(scene.camera[0], scene.camera[1])


def test_points_are_where_mujocos_camera_shows_them() -> None:
    camera, (width, height) = mujoco_camera(), FRAME
    points = np.random.default_rng(3).uniform(-0.8, 0.8, (20, 3))
    x, y, depth = VIEW.project(points).T
    ahead, up = np.array(camera.forward), np.array(camera.up)
    along = points - np.array(camera.pos)
    np.testing.assert_allclose(depth, along @ ahead, rtol=1e-5)
    per_metre = height / (camera.frustum_top - camera.frustum_bottom) * camera.frustum_near
    np.testing.assert_allclose(
        x - width / 2, per_metre * along @ np.cross(ahead, up) / depth, atol=0.01
    )
    np.testing.assert_allclose(height / 2 - y, per_metre * along @ up / depth, atol=0.01)


def test_what_is_behind_the_camera_has_no_place() -> None:
    places = VIEW.project(np.array([[0.5, -0.2, 0.15], [5.0, -3.0, 2.0]]))
    assert places[0] == pytest.approx([FRAME[0] / 2, FRAME[1] / 2, 2.2])
    assert np.isnan(places[1, :2]).all()


def test_each_name_is_in_its_robots_colour_over_its_trunk() -> None:
    picture = Image.new("RGB", FRAME, "grey")
    trunks = np.array([[0.5, 0.3, 0.27], [0.5, -0.6, 0.27]])
    write_names(picture, ("r1", "r2"), trunks, VIEW)
    pixels = np.asarray(picture).astype(int)
    for index, (x, y, _) in enumerate(VIEW.project(trunks)):
        colour = np.rint(255 * np.array(robot_rgb(index)))
        rows, columns = np.nonzero(np.abs(pixels - colour).max(axis=2) < 8)
        assert len(rows) > 10
        assert np.abs(columns - x).max() < 15
        assert -80 < (rows - y).min() < (rows - y).max() < -10


def test_a_robot_behind_the_camera_is_not_named() -> None:
    picture = Image.new("RGB", FRAME, "grey")
    write_names(picture, ("r1",), np.array([[5.0, -3.0, 2.0]]), VIEW)
    assert len(np.unique(np.asarray(picture))) == 1
