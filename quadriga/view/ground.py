"""What lies on the plane of a world, as boxes and as a surface of triangles."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from quadriga.shared.robots.conventions import Array
from quadriga.sim_server.terrain.terrain import Terrain

_MOST: Final = 40_000  # vertices of a surface: more would take a browser long to load
_SUNK: Final = 0.002  # m, by which a surface lies under the feet that touch it


class Boxes(NamedTuple):
    """Boxes that lie on the ground: centres (b, 3), attitudes wxyz (b, 4), full edges (b, 3), m.

    `colours` are sRGB, 0 … 255, shape (b, 3).
    """

    positions: Array
    quats: Array
    edges: Array
    colours: NDArray[np.uint8]


class Surface(NamedTuple):
    """Triangles: vertices (V, 3), world frame, m, and their indices (F, 3)."""

    vertices: Array
    faces: NDArray[np.int64]


def read_boxes(terrain: Terrain) -> Boxes:
    """All boxes of a terrain."""
    model = _compile(terrain)
    chosen = model.geom_type == mujoco.mjtGeom.mjGEOM_BOX
    return Boxes(
        positions=model.geom_pos[chosen],
        quats=model.geom_quat[chosen],
        edges=2.0 * model.geom_size[chosen],
        colours=np.rint(255.0 * model.geom_rgba[chosen, :3]).astype(np.uint8),
    )


def read_surface(terrain: Terrain) -> Surface | None:
    """The surface of a terrain that is given by heights over a grid; None of any other."""
    model = _compile(terrain)
    if not model.nhfield:
        return None
    geom = int(np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_HFIELD)[0])
    centre, half = model.geom_pos[geom], model.hfield_size[0]
    cells = int(model.hfield_nrow[0]), int(model.hfield_ncol[0])
    stride = max(1, int(np.ceil(np.sqrt(cells[0] * cells[1] / _MOST))))
    rows, columns = (max(2, count // stride) for count in cells)
    x = np.linspace(centre[0] - half[0], centre[0] + half[0], columns)
    y = np.linspace(centre[1] - half[1], centre[1] + half[1], rows)
    points = np.stack([*np.meshgrid(x, y), np.zeros((rows, columns))], axis=-1)
    points[..., 2] = terrain.height(points[..., 0], points[..., 1]) - _SUNK
    return Surface(points.reshape(-1, 3), _triangles(rows, columns))


def _compile(terrain: Terrain) -> Any:
    spec = mujoco.MjSpec()
    terrain.add_to(spec)
    return spec.compile()


def _triangles(rows: int, columns: int) -> NDArray[np.int64]:
    """Two triangles for each cell of a grid, counter-clockwise from above, split as MuJoCo does."""
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    return np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
