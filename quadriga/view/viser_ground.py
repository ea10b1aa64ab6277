"""SHELL: the ground in a browser, and boxes on it or on robots."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from quadriga.shared.robots.conventions import Array
from quadriga.sim_server.terrain.terrain import Terrain
from quadriga.view.ground import read_boxes, read_surface
from quadriga.view.scene_colours import to_linear
from quadriga.view.team_shape import TeamShape

_PLANE: Final = (-0.004, 60.0)  # m: height, under all that lies on the ground; edge
_EARTH: Final = (168, 152, 120)
_STONES: Final = 6000  # at most, of those that lie loose: more would make a page slow
_STRIDE: Final = 0.3  # m, by which the team has moved before others are shown


def add_ground(scene: Any, shape: TeamShape) -> None:
    """The plane and what lies fast on it."""
    height, edge = _PLANE
    scene.add_grid(
        "/team/plane",
        edge,
        edge,
        cell_size=0.25,
        section_size=1.0,
        cell_color=(222, 225, 227),
        section_color=(190, 195, 198),
        plane_color=(240, 241, 242),
        plane_opacity=1.0,
        fade_distance=30.0,
        position=(0.0, 0.0, height),
    )
    boxes, surface = read_boxes(shape.terrain), read_surface(shape.terrain)
    if len(boxes.positions):
        add_boxes(scene, "/team/boxes", *boxes)
    if surface is not None:
        scene.add_mesh_simple(
            "/team/surface", surface.vertices, surface.faces, color=_EARTH, flat_shading=True
        )


class StoneLayer:
    """The loose stones around the team, as they lay before the walk."""

    def __init__(self, scene: Any, terrain: Terrain) -> None:
        """Show those around the place where the team starts, if there are any."""
        from trimesh.creation import icosphere

        self._terrain, self._centre = terrain, np.zeros(2)
        stones = terrain.stones_near(self._centre, _STONES)
        if not len(stones.poses):
            self._batch = None
            return
        ball = icosphere(0)
        self._batch = scene.add_batched_meshes_simple(
            "/team/stones",
            np.asarray(ball.vertices),
            np.asarray(ball.faces),
            batched_wxyzs=stones.poses[:, 3:],
            batched_positions=stones.poses[:, :3],
            batched_scales=stones.halves,
            batched_colors=to_linear(255.0 * stones.colours),
            lod="off",
        )

    def follow(self, centre: Array) -> None:
        """Show those around a place, shape (2,), m, once the team has come so far."""
        if self._batch is None or np.linalg.norm(centre - self._centre) < _STRIDE:
            return
        self._centre = centre
        stones = self._terrain.stones_near(centre, _STONES)
        self._batch.batched_positions = stones.poses[:, :3]
        self._batch.batched_wxyzs = stones.poses[:, 3:]
        self._batch.batched_scales = stones.halves
        self._batch.batched_colors = to_linear(255.0 * stones.colours)


def add_boxes(
    scene: Any, name: str, positions: Array, quats: Array, edges: Array, colours: Any
) -> Any:
    """Boxes as one batch.

    Args:
        scene: of the server.
        name: of the batch.
        positions: centres, (b, 3), m.
        quats: attitudes wxyz, (b, 4).
        edges: full lengths, (b, 3), m.
        colours: sRGB, 0 … 255, (b, 3).
    """
    from trimesh.creation import box

    cube = box((1.0, 1.0, 1.0))
    corners = cube.vertices[cube.faces].reshape(-1, 3)  # each face its own: edges stay sharp
    return scene.add_batched_meshes_simple(
        name,
        corners,
        np.arange(len(corners)).reshape(-1, 3),
        batched_wxyzs=quats,
        batched_positions=positions,
        batched_scales=edges,
        batched_colors=to_linear(colours),
        lod="off",
    )
