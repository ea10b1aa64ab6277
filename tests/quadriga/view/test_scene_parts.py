"""What is drawn: the ground, links that look alike, arrows, words."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quadriga.pictures.meshes import link_meshes
from quadriga.shared.config.load import load
from quadriga.shared.recording.reader import Recording
from quadriga.sim_server.terrain.terrain import Terrain
from quadriga.view import words
from quadriga.view.compose import compose
from quadriga.view.ground import read_boxes, read_surface
from quadriga.view.mesh_groups import group_meshes
from quadriga.view.picture import RobotAccount
from quadriga.view.port import PageAddress
from quadriga.view.readings import read_accounts
from quadriga.view.recorded import RecordedRun
from quadriga.view.scene_colours import to_linear
from quadriga.view.team_shape import build_team_shape
from quadriga.view.traffic import KeyTraffic
from quadriga.view.viser_ground import StoneLayer
from quadriga.view.viser_scene import NEWTON, arrows_of
from quadriga.view.viser_server import open_server


def terrain(kind: str, **keys: object) -> Terrain:
    given = {"world.terrain": kind, "world.duration": 1.0, "world.terrain_height": 0.05}
    return build_team_shape(load(None, given | keys)).terrain


def test_boxes_are_as_high_as_the_ground_is() -> None:
    ground = terrain("boxes")
    boxes = read_boxes(ground)
    assert len(boxes.positions) > 20
    tops = boxes.positions[:, 2] + boxes.edges[:, 2] / 2
    assert tops.max() == pytest.approx(ground.top)
    # Others may lie over a box, none lies deeper than its own top.
    assert (ground.height(*boxes.positions[:, :2].T) >= tops - 1e-9).all()
    assert read_surface(ground) is None


def test_a_surface_follows_the_heights() -> None:
    ground = terrain("heightfield")
    surface = read_surface(ground)
    assert surface is not None
    x, y, z = surface.vertices.T
    assert z == pytest.approx(ground.height(x, y), abs=0.003)
    corners = surface.vertices[surface.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (normals[:, 2] > 0.0).all()  # seen from above
    assert not len(read_boxes(ground).positions)


def test_loose_stones_around_the_team_are_shown_wherever_it_goes() -> None:
    pebbles = terrain("pebbles")
    with open_server(PageAddress(0), "stones") as server:
        layer = StoneLayer(server.scene, pebbles)
        batch = layer._batch
        assert batch is not None
        for x in (0.0, 0.1, 2.0):
            layer.follow(np.array([x, 0.2]))
            near = pebbles.stones_near(np.array([x, 0.2]) if x > 1.0 else np.zeros(2), 6000)
            assert batch.batched_positions == pytest.approx(near.poses[:, :3], abs=1e-6)
            assert batch.batched_scales == pytest.approx(near.halves, abs=1e-6)
        assert len(near.poses) > 500
        assert StoneLayer(server.scene, terrain("boxes"))._batch is None


@pytest.mark.parametrize("kind", ["a1", "go2"])
def test_links_that_look_alike_are_one_batch(kind: str) -> None:
    shape = build_team_shape(load(None, {"team.robot": kind}))
    meshes = link_meshes(shape.config.robot.urdf_path())
    groups = group_meshes(meshes, shape.skeleton.links)
    assert len(groups) < sum(len(several) for several in meshes.values())
    drawn = sorted(k for group in groups for k in group.links)
    assert len(drawn) == sum(len(several) for several in meshes.values())
    hulls = [group for group in groups if group.is_hull]
    assert [group.links for group in hulls] == [(0,)]


def test_arrows_begin_at_feet_and_are_as_long_as_forces() -> None:
    feet = np.arange(12.0).reshape(1, 4, 3)
    forces = np.zeros((1, 4, 3))
    forces[0, 2] = 3.0, 0.0, 40.0
    arrows = arrows_of(feet, forces)
    assert arrows == pytest.approx(np.array([[feet[0, 2], feet[0, 2] + NEWTON * forces[0, 2]]]))
    out_of_sight = arrows_of(feet, np.zeros((1, 4, 3)))
    assert (out_of_sight[..., 2] < -10.0).all()


def test_colours_that_are_not_decoded_keep_their_ends() -> None:
    assert to_linear([[0, 128, 255]]).tolist() == [[0, 56, 255]]


def test_words_say_what_is_true_and_escape_what_others_say(known_run: Path) -> None:
    run = RecordedRun(Recording(known_run / "run.mcap"))
    snapshot = run.snapshot(3000)
    picture = compose(run.shape, snapshot)
    heading = words.format_heading(run.shape, picture, snapshot.reference, "live")
    assert "the simulator's truth" in heading
    assert "3.00 s" in heading
    assert "0.50 m/s ahead" in heading
    accounts = read_accounts(run.shape, snapshot)
    table = words.format_robots(run.shape.robots, accounts, [True, True])
    assert table.count("<tr>") == 3
    assert "r2 40 ms" in table
    shown = words._cells_of(RobotAccount("estop", "<script>"), known=True)[0]
    assert "&lt;script&gt;" in shown
    assert "<script>" not in words.format_happenings([(150, "push <script>")])
    assert "not heard yet" in words._cells_of(RobotAccount(), known=False)[0]


def test_traffic_names_what_is_silent() -> None:
    rows = (KeyTraffic("r1/state", 999.6, 0, 0.01), KeyTraffic("r2/plan", 0.0, None, None))
    table = words.format_traffic(rows)
    assert "1000" in table
    assert table.count("–") == 2
    assert "opacity:0.5" in table.split("r2/plan")[0].rsplit("<tr>", 1)[1]
