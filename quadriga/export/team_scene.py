"""A recorded team in space, as every format draws it: links and looks, terrain, yokes, forces."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from quadriga.pictures.link_mesh import LinkMesh, LinkMeshes
from quadriga.pictures.meshes import link_meshes
from quadriga.pictures.poses import PosedTeam
from quadriga.pictures.robot_shapes import HIDDEN_GROUP, dress, paint
from quadriga.recordings.truth import Ticks
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import MeshError
from quadriga.shared.robots.conventions import Array, robot_names
from quadriga.sim_server.terrain.terrain import Terrain

NEWTON: Final = 0.002  # m of arrow per N
LEAST: Final = 1.0  # N; a smaller force is not drawn
PERIOD_MS: Final = 10  # least time between two poses of the team
TAG: Final = 0.2  # m from the middle of a trunk up to its robot's name
YOKE: Final = (0.72, 0.53, 0.04)  # sRGB
GROUND: Final = (0.60, 0.54, 0.42)
PLANNED: Final = (0.69, 0.31, 0.55)  # as curves of what is planned
PLANNED_NAME: Final = "planned"
_CELL: Final = 0.05  # m, grid of the terrain
_MARGIN: Final = 1.5  # m of terrain around the team's path


@dataclass(frozen=True, slots=True)
class Solid:
    """A box, ball or capsule of a link.

    Attributes:
        kind: box, sphere or capsule.
        position: of its centre in the link's frame, m.
        quat_wxyz: its turn in the link's frame.
        size: half the edges of a box; of the others radius and half the length of the straight
            part; m.
        rgba: sRGB and opacity, 0 … 1.
    """

    kind: str
    position: Array
    quat_wxyz: Array
    size: Array
    rgba: tuple[float, float, float, float]


_KINDS: Final = {
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): "capsule",
}


class TeamScene:
    """The team's links and surroundings, put where a recording has them.

    Attributes:
        names: of the robots.
        links: names of all links, `r1/trunk` and so on.
        problem: why robots are boxes and capsules; "" if they have their meshes.
        yokes: pairs of robots by index.
    """

    def __init__(self, config: Config) -> None:
        self.names, self.problem = robot_names(config.team.robots), ""
        meshes: LinkMeshes = {}
        try:
            meshes = link_meshes(config.robot.urdf_path())
        except MeshError as error:
            self.problem = str(error)
        self._posed = PosedTeam(config, partial(dress, robots=self.names, meshes=meshes))
        self._model = self._posed.model
        # Body 0 is the world itself; then come the robots' links, named r1/trunk and so on; then
        # loose stones, if any, of which nothing is recorded.
        names = [self._model.body(i).name for i in range(1, self._model.nbody)]
        self.links = [name for name in names if "/" in name]
        self.yokes = self._posed.team.yokes
        self._surfaces = {
            f"{robot}/{body}": several
            for index, robot in enumerate(self.names)
            for body, several in paint(meshes, index).items()
        }

    def set(self, qpos: Array) -> None:
        """Put the team where positions (19 n,) have it."""
        self._posed.set(qpos)

    def link_poses(self) -> tuple[Array, Array]:
        """Positions (L, 3) [m] and quaternions wxyz (L, 4) of all links in the world."""
        physics, of_links = self._posed.physics, slice(1, 1 + len(self.links))
        return physics.xpos[of_links].copy(), physics.xquat[of_links].copy()

    def surfaces(self, link: str) -> tuple[LinkMesh, ...]:
        """The meshes of a link, in its frame; the trunk's has its robot's colour."""
        return self._surfaces.get(link, ())

    def solids(self, link: str) -> Iterator[Solid]:
        """What a link shows beside its meshes: its payload, or all of it where meshes miss."""
        model: Any = self._model
        for geom in np.flatnonzero(model.geom_bodyid == 1 + self.links.index(link)).tolist():
            kind = _KINDS.get(int(model.geom_type[geom]))
            if kind and model.geom_group[geom] != HIDDEN_GROUP:
                red, green, blue, alpha = model.geom_rgba[geom].tolist()
                yield Solid(
                    kind,
                    model.geom_pos[geom],
                    model.geom_quat[geom],
                    model.geom_size[geom],
                    (red, green, blue, alpha),
                )

    def terrain(self, path: Array) -> tuple[Array, NDArray[np.int64]] | None:
        """Points (P, 3) and triangles (T, 3) of the ground around a path (F, 3), if not flat."""
        terrain: Terrain = self._posed.team.terrain
        if not terrain.top:
            return None
        low = np.floor((path[:, :2].min(axis=0) - _MARGIN) / _CELL) * _CELL
        high = path[:, :2].max(axis=0) + _MARGIN
        x, y = np.meshgrid(*(np.arange(low[k], high[k], _CELL) for k in (0, 1)))
        points = np.stack([x, y, terrain.height(x, y)], axis=-1).reshape(-1, 3)
        return points, _triangles(*x.shape)

    def anchors(self) -> Array:
        """Where the yokes' ball joints are, shape (n, 3), m, world."""
        return np.array([self._posed.physics.site(f"{name}/yoke").xpos for name in self.names])

    def trunks(self) -> Array:
        """Positions of the trunks, shape (n, 3), m, world."""
        return self._posed.trunks()

    def headings(self) -> Array:
        """Yaw of the trunks, shape (n,), rad."""
        axes = np.array([self._posed.physics.body(f"{name}/trunk").xmat for name in self.names])
        yaw: Array = np.arctan2(axes[:, 3], axes[:, 0])
        return yaw

    def feet(self) -> Array:
        """Positions of all feet, shape (n, 4, 3), m, world."""
        return self._posed.feet()

    def ground_forces(self, planned: Mapping[str, Array]) -> Array:
        """Planned forces (12,) [N] of robots, turned from their yaw frames into the world's.

        Returns:
            Shape (n, 4, 3); zeros for who has none.
        """
        forces = np.zeros((len(self.names), 4, 3))
        for index, (name, yaw) in enumerate(zip(self.names, self.headings(), strict=True)):
            if name in planned:
                cos, sin = np.cos(yaw), np.sin(yaw)
                turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
                forces[index] = planned[name].reshape(4, 3) @ turn.T
        return forces


def path_ticks(ticks: Ticks, period: int) -> Ticks:
    """Those of `ticks` that are at least `period` ms apart."""
    chosen: list[int] = []
    for tick in ticks.tolist():
        if not chosen or tick - chosen[-1] >= period:
            chosen.append(tick)
    return np.array(chosen, dtype=np.int64)


def _triangles(rows: int, columns: int) -> NDArray[np.int64]:
    """Corners of the two triangles of each cell of a grid, by the grid's row-major index."""
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    return np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
