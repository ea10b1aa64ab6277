"""The team as Foxglove draws it: frames of all links, bodies, terrain, yokes, contact forces."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import foxglove.messages as fox
import mujoco
import numpy as np

from quadriga.pictures.poses import PosedTeam
from quadriga.recordings.truth import Ticks
from quadriga.shared.config.sections import Config
from quadriga.shared.robot.conventions import Array
from quadriga.sim_server.terrain.terrain import Terrain

WORLD: Final = "world"
_NEWTON: Final = 0.002  # m of arrow per N
_LEAST: Final = 1.0  # N; a smaller force is not drawn
_YOKE: Final = fox.Color(r=0.85, g=0.65, b=0.13, a=1.0)
_FORCE: Final = fox.Color(r=0.1, g=0.55, b=0.95, a=1.0)
_GROUND: Final = fox.Color(r=0.60, g=0.54, b=0.42, a=1.0)
_CELL: Final = 0.05  # m, grid of the terrain
_MARGIN: Final = 1.5  # m of terrain around the team's path


class Scene:
    """Frames and drawings of a recorded team."""

    def __init__(self, config: Config) -> None:
        self._posed = PosedTeam(config)
        self._model = self._posed.model
        # Body 0 is the world itself; then come the robots' links, named r1/trunk and so on; then
        # loose stones, if any, of which nothing is recorded.
        names = [self._model.body(i).name for i in range(1, self._model.nbody)]
        self._links = [name for name in names if "/" in name]
        self._trunks = self._posed.team.trunks
        self._yokes = self._posed.team.yokes

    def set(self, qpos: Array) -> None:
        """Put the team where positions (19 n,) have it."""
        self._posed.set(qpos)

    def frames(self, tick: int) -> fox.FrameTransforms:
        """Pose of every link in the world."""
        physics, stamp = self._posed.physics, stamp_of(tick)
        of_links = slice(1, 1 + len(self._links))
        places, turns = physics.xpos[of_links].tolist(), physics.xquat[of_links].tolist()
        poses = zip(self._links, places, turns, strict=True)
        return fox.FrameTransforms(
            transforms=[
                fox.FrameTransform(
                    timestamp=stamp,
                    parent_frame_id=WORLD,
                    child_frame_id=link,
                    translation=fox.Vector3(x=x, y=y, z=z),
                    rotation=fox.Quaternion(w=qw, x=qx, y=qy, z=qz),
                )
                for link, (x, y, z), (qw, qx, qy, qz) in poses
            ]
        )

    def bodies(self, tick: int) -> fox.SceneUpdate:
        """What the links look like; drawn once, they move with their frames."""
        entities = []
        for i, link in enumerate(self._links, start=1):
            shapes = _Shapes()
            for geom in np.flatnonzero(self._model.geom_bodyid == i).tolist():
                shapes.add(self._model, geom)
            if shapes:
                entities.append(
                    fox.SceneEntity(
                        timestamp=stamp_of(tick),
                        frame_id=link,
                        id=link,
                        frame_locked=True,
                        cubes=shapes.cubes,
                        spheres=shapes.spheres,
                        cylinders=shapes.cylinders,
                    )
                )
        return fox.SceneUpdate(entities=entities)

    def terrain(self, tick: int, path: Array) -> fox.SceneUpdate:
        """The ground around a path (F, 3), if it is not flat."""
        terrain: Terrain = self._posed.team.terrain
        if not terrain.top:
            return fox.SceneUpdate(entities=[])
        low = np.floor((path[:, :2].min(axis=0) - _MARGIN) / _CELL) * _CELL
        high = path[:, :2].max(axis=0) + _MARGIN
        x, y = np.meshgrid(*(np.arange(low[k], high[k], _CELL) for k in (0, 1)))
        points = np.stack([x, y, terrain.height(x, y)], axis=-1).reshape(-1, 3)
        surface = fox.TriangleListPrimitive(
            pose=_pose(),
            color=_GROUND,
            indices=_triangles(*x.shape).tolist(),
            points=[fox.Point3(x=a, y=b, z=c) for a, b, c in points.tolist()],
        )
        entity = fox.SceneEntity(
            timestamp=stamp_of(tick), frame_id=WORLD, id="terrain", triangles=[surface]
        )
        return fox.SceneUpdate(entities=[entity])

    def forces(self, tick: int, grf: Array) -> fox.SceneUpdate:
        """Yokes as lines, true contact forces (n, 4, 3) on the feet as arrows."""
        anchors = self._anchors()
        points = [_point(anchors[i]) for pair in self._yokes for i in pair]
        lines = fox.LinePrimitive(
            type=fox.LinePrimitiveLineType.LineList,
            pose=_pose(),
            thickness=0.02,
            points=points,
            color=_YOKE,
        )
        stamp = stamp_of(tick)
        return fox.SceneUpdate(
            entities=[
                fox.SceneEntity(timestamp=stamp, frame_id=WORLD, id="yokes", lines=[lines]),
                fox.SceneEntity(
                    timestamp=stamp, frame_id=WORLD, id="forces", arrows=list(self._arrows(grf))
                ),
            ]
        )

    def _anchors(self) -> Array:
        """Where the yokes' ball joints are, shape (n, 3), m, world."""
        sites = [self._posed.physics.site(f"{name}/yoke").xpos for name in self._posed.names]
        return np.array(sites)

    def _arrows(self, grf: Array) -> Iterator[fox.ArrowPrimitive]:
        for foot, force in zip(self._posed.feet().reshape(-1, 3), grf.reshape(-1, 3), strict=True):
            size = float(np.linalg.norm(force))
            if size >= _LEAST:
                length = _NEWTON * size
                yield fox.ArrowPrimitive(
                    pose=_pose(foot, _along(force / size)),
                    shaft_length=0.8 * length,
                    shaft_diameter=0.012,
                    head_length=0.2 * length,
                    head_diameter=0.03,
                    color=_FORCE,
                )


class _Shapes:
    """Primitives of one link."""

    def __init__(self) -> None:
        self.cubes: list[fox.CubePrimitive] = []
        self.spheres: list[fox.SpherePrimitive] = []
        self.cylinders: list[fox.CylinderPrimitive] = []

    def __bool__(self) -> bool:
        return bool(self.cubes or self.spheres or self.cylinders)

    def add(self, model: Any, geom: int) -> None:
        """Add a geom; a capsule becomes a cylinder."""
        size, kind = model.geom_size[geom], model.geom_type[geom]
        pose = _pose(model.geom_pos[geom], model.geom_quat[geom])
        r, g, b, a = model.geom_rgba[geom].tolist()
        color = fox.Color(r=r, g=g, b=b, a=a)
        if kind == mujoco.mjtGeom.mjGEOM_BOX:
            self.cubes.append(fox.CubePrimitive(pose=pose, size=_vector(2 * size), color=color))
        elif kind == mujoco.mjtGeom.mjGEOM_SPHERE:
            full = _vector(np.full(3, 2 * size[0]))
            self.spheres.append(fox.SpherePrimitive(pose=pose, size=full, color=color))
        elif kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
            full = _vector(np.array([2 * size[0], 2 * size[0], 2 * size[1]]))
            self.cylinders.append(
                fox.CylinderPrimitive(
                    pose=pose, size=full, bottom_scale=1.0, top_scale=1.0, color=color
                )
            )


def stamp_of(tick: int) -> fox.Timestamp:
    """World time as Foxglove's timestamp: seconds since 1970 are seconds since the start."""
    return fox.Timestamp(sec=tick // 1000, nsec=tick % 1000 * 1_000_000)


def path_ticks(ticks: Ticks, period: int) -> Ticks:
    """Those of `ticks` that are at least `period` ms apart."""
    chosen: list[int] = []
    for tick in ticks.tolist():
        if not chosen or tick - chosen[-1] >= period:
            chosen.append(tick)
    return np.array(chosen, dtype=np.int64)


def _triangles(rows: int, columns: int) -> Any:
    """Corners of the two triangles of each cell of a grid, by the grid's row-major index."""
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    return np.stack([a, b, c, a, c, d], axis=-1).reshape(-1)


def _along(direction: Array) -> Array:
    """The shortest rotation, wxyz, that takes the x axis to a unit vector."""
    x, y, z = direction.tolist()
    if x < -1.0 + 1e-9:
        return np.array([0.0, 0.0, 0.0, 1.0])
    quat = np.array([1.0 + x, 0.0, -z, y])
    unit: Array = quat / np.linalg.norm(quat)
    return unit


def _pose(position: Any = (0.0, 0.0, 0.0), quat_wxyz: Any = (1.0, 0.0, 0.0, 0.0)) -> fox.Pose:
    w, x, y, z = (float(value) for value in quat_wxyz)
    return fox.Pose(
        position=_vector(np.asarray(position)), orientation=fox.Quaternion(w=w, x=x, y=y, z=z)
    )


def _vector(values: Array) -> fox.Vector3:
    x, y, z = values.tolist()
    return fox.Vector3(x=x, y=y, z=z)


def _point(values: Array) -> fox.Point3:
    x, y, z = values.tolist()
    return fox.Point3(x=x, y=y, z=z)
