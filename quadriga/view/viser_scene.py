"""SHELL: the team in a browser; each kind of link of all robots is one batch of meshes."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import viser

from quadriga.charts.colours import LINES
from quadriga.pictures.link_mesh import LinkMeshes
from quadriga.shared.robots.colours import robot_colour
from quadriga.shared.robots.conventions import Array
from quadriga.view.mesh_groups import MeshGroup, group_meshes
from quadriga.view.picture import Picture
from quadriga.view.scene_colours import rgb_of, to_linear
from quadriga.view.skeleton import rotate
from quadriga.view.team_shape import TeamShape
from quadriga.view.viser_ground import StoneLayer, add_boxes, add_ground

NEWTON: Final = 0.003  # m of arrow per N
LEAST: Final = 2.0  # N; a smaller force is not drawn
_PATH_ABOVE: Final = 0.13  # m over the trunks' origins: inside a trunk nobody would see a path
_LABEL_ABOVE: Final = 0.2  # m
_LABEL_OFF: Final = 0.01  # m, by which a name may be off its place
_UNLOADED: Final = np.array((8, 8, 8), dtype=np.uint8)  # of a foot in the air
_ARROWS: Final = ("true", "planned")  # styles of the charts
_YOKE: Final = (217, 166, 33)
_LOAD: Final = (140, 92, 51)
_LOAD_BOX: Final = (0.2, 0.15, 0.04)  # m
# Where the camera is first, ahead and to the left: from the middle of one robot, m; for each
# doubling of the team by what share it is farther away; its field of view, rad.
_CAMERA: Final = ((0.8, 1.25, 0.65), 0.45, 0.8)


class ViewScene:
    """All that is drawn of a team.

    Attributes:
        shown: by name what can be hidden.
        follows: whether the team stays in the middle while the ground moves under it.
    """

    def __init__(self, server: viser.ViserServer, shape: TeamShape, meshes: LinkMeshes) -> None:
        """Draw the team at its place."""
        self._server, self._shape, scene = server, shape, server.scene
        colours = [rgb_of(robot_colour(i)) for i in range(shape.count)]
        self._colours = to_linear(np.array(colours))
        self.follows = True
        self._root = scene.add_frame("/team", show_axes=False)
        add_ground(scene, shape)
        self._stones = StoneLayer(scene, shape.terrain)
        self._groups: list[tuple[list[int], Any]] = [
            (list(group.links), self._add_group(f"/team/links/{k}", group))
            for k, group in enumerate(group_meshes(meshes, shape.skeleton.links))
        ]
        self._feet = self._add_balls("/team/feet")
        self._loads = self._add_loads()
        count = max(len(shape.yokes), 1)
        self._yokes: Any = scene.add_line_segments(
            "/team/yokes", np.zeros((count, 2, 3)), _YOKE, thickness=0.012
        )
        self._yokes.visible = bool(shape.yokes)
        self._paths = self._add_paths()
        arrows: dict[str, Any] = {"shaft_radius": 0.007, "head_radius": 0.016, "head_length": 0.04}
        colour_of = {style: to_linear(rgb_of(LINES[style]["color"])) for style in _ARROWS}
        self._arrows: dict[str, Any] = {
            style: scene.add_arrows(f"/team/{style}", _NOWHERE, colour, **arrows)
            for style, colour in colour_of.items()
        }
        self._labels = [
            scene.add_label(f"/labels/{name}", name, anchor="bottom-center")
            for name in shape.robots
        ]
        self._label_places = np.zeros((shape.count, 3))
        self.shown: dict[str, list[Any]] = {
            **{f"{style} ground forces": [self._arrows[style]] for style in _ARROWS},
            "predicted paths": [self._paths],
            "names": list(self._labels),
        }
        _place_camera(server, shape.count)

    def show(self, picture: Picture) -> None:
        """Bring everything to where it is in a picture; all of it arrives at once."""
        with self._server.atomic():
            x, y, _ = picture.centre.tolist() if self.follows else (0.0, 0.0, 0.0)
            self._root.position = (-x, -y, 0.0)
            self._stones.follow(picture.centre[:2])
            for links, handle in self._groups:
                handle.batched_positions = picture.link_positions[:, links].reshape(-1, 3)
                handle.batched_wxyzs = picture.link_quats[:, links].reshape(-1, 4)
            self._feet.batched_positions = picture.feet.reshape(-1, 3)
            self._feet.batched_colors = self._foot_colours(picture)
            self._show_loads(picture)
            if self._shape.yokes:
                self._yokes.points = picture.anchors[np.array(self._shape.yokes)]
            for style, forces in zip(
                _ARROWS, (picture.true_forces, picture.planned_forces), strict=True
            ):
                self._arrows[style].points = arrows_of(picture.feet, forces)
            raised = picture.paths + np.array([0.0, 0.0, _PATH_ABOVE])
            self._paths.points = np.stack([raised[:, :-1], raised[:, 1:]], axis=2).reshape(-1, 2, 3)
            self._move_labels(picture.trunk[:, :3] + np.array([-x, -y, _LABEL_ABOVE]))

    def _move_labels(self, places: Array) -> None:
        """Bring names over robots; what moves with the picture needs not be told each time."""
        if np.abs(places - self._label_places).max() > _LABEL_OFF:
            self._label_places = places
            for label, place in zip(self._labels, places, strict=True):
                label.position = place

    def name_robots(self, texts: list[str]) -> None:
        """What stands over each robot."""
        for label, text in zip(self._labels, texts, strict=True):
            label.text = text

    def _foot_colours(self, picture: Picture) -> Any:
        colours = np.repeat(self._colours[:, None], picture.contact.shape[1], axis=1)
        return np.where(picture.contact[..., None], colours, _UNLOADED).reshape(-1, 3)

    def _add_group(self, name: str, group: MeshGroup) -> Any:
        batch = self._shape.count * len(group.links)
        plain = to_linear(255.0 * np.array(group.mesh.rgba[:3]))
        colours = self._colours if group.is_hull else np.tile(plain, (batch, 1))
        return self._server.scene.add_batched_meshes_simple(
            name,
            group.mesh.vertices,
            group.mesh.faces,
            batched_wxyzs=_upright(batch),
            batched_positions=np.zeros((batch, 3)),
            batched_colors=colours,
            lod="off",
        )

    def _add_balls(self, name: str) -> Any:
        from trimesh.creation import icosphere

        ball = icosphere(2, 1.15 * self._shape.config.robot.geometry.foot_radius)
        batch = 4 * self._shape.count
        return self._server.scene.add_batched_meshes_simple(
            name,
            np.asarray(ball.vertices),
            np.asarray(ball.faces),
            batched_wxyzs=_upright(batch),
            batched_positions=np.zeros((batch, 3)),
            batched_colors=np.zeros((batch, 3), dtype=np.uint8),
            lod="off",
        )

    def _add_loads(self) -> Any:
        carriers, _ = self._shape.loads
        return carriers and add_boxes(
            self._server.scene,
            "/team/loads",
            np.zeros((len(carriers), 3)),
            _upright(len(carriers)),
            np.tile(_LOAD_BOX, (len(carriers), 1)),
            np.tile(_LOAD, (len(carriers), 1)),
        )

    def _show_loads(self, picture: Picture) -> None:
        carriers, places = self._shape.loads
        if carriers:
            trunk = picture.trunk[list(carriers)]
            self._loads.batched_positions = trunk[:, :3] + rotate(trunk[:, 3:], places)
            self._loads.batched_wxyzs = trunk[:, 3:]

    def _add_paths(self) -> Any:
        segments = self._shape.config.planner.N
        colours = np.repeat(self._colours, 2 * segments, axis=0).reshape(-1, 2, 3)
        return self._server.scene.add_line_segments(
            "/team/paths", np.zeros(colours.shape), colours, thickness=0.014
        )


_NOWHERE: Final = np.array([[[0.0, 0.0, -50.0], [0.0, 0.0, -49.9]]])  # an arrow nobody sees


def arrows_of(feet: Array, forces: Array) -> Array:
    """Arrows from feet along forces, shape (N, 2, 3); one out of sight if there is no force."""
    begin, along = feet.reshape(-1, 3), NEWTON * forces.reshape(-1, 3)
    drawn = np.linalg.norm(along, axis=1) > NEWTON * LEAST
    if not drawn.any():
        return _NOWHERE
    arrows: Array = np.stack([begin, begin + along], axis=1)[drawn]
    return arrows


def _upright(count: int) -> Array:
    return np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))


def _place_camera(server: viser.ViserServer, robots: int) -> None:
    place, more, view = _CAMERA
    away = 1.0 + more * np.log2(robots)
    x, y, z = (away * value for value in place)
    camera = server.initial_camera
    camera.position, camera.look_at, camera.fov = (x, y, z), (0.0, 0.0, 0.15), view
