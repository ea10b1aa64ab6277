"""The team as Foxglove draws it: frames of all links, bodies, terrain, yokes, contact forces."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

import foxglove.messages as fox
import numpy as np

from quadriga.export.team_scene import (
    GROUND,
    LEAST,
    NEWTON,
    PLANNED,
    PLANNED_NAME,
    TAG,
    YOKE,
    Solid,
    TeamScene,
)
from quadriga.pictures.link_mesh import LinkMesh
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.colours import Rgb, robot_rgb
from quadriga.shared.robots.conventions import Array

WORLD: Final = "world"
_THICK, _THIN = 0.012, 0.007  # m, shafts of true and of planned forces
_FONT: Final = 0.07  # m


class Scene:
    """Frames and drawings of a recorded team."""

    def __init__(self, config: Config) -> None:
        self._team = TeamScene(config)

    def set(self, qpos: Array) -> None:
        """Put the team where positions (19 n,) have it."""
        self._team.set(qpos)

    def frames(self, tick: int) -> fox.FrameTransforms:
        """Pose of every link in the world."""
        stamp = stamp_of(tick)
        places, turns = (values.tolist() for values in self._team.link_poses())
        poses = zip(self._team.links, places, turns, strict=True)
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
        entities = [self._body(link, tick) for link in self._team.links]
        return fox.SceneUpdate(entities=[entity for entity in entities if entity is not None])

    def _body(self, link: str, tick: int) -> fox.SceneEntity | None:
        """The looks of one link, its robot's name with that of its trunk; None if it has none."""
        solids = list(self._team.solids(link))
        surfaces = [_surface(mesh) for mesh in self._team.surfaces(link)]
        if not solids and not surfaces:
            return None
        robot, _, body = link.partition("/")
        return fox.SceneEntity(
            timestamp=stamp_of(tick),
            frame_id=link,
            id=link,
            frame_locked=True,
            triangles=surfaces,
            cubes=[_cube(solid) for solid in solids if solid.kind == "box"],
            spheres=[_sphere(solid) for solid in solids if solid.kind == "sphere"],
            cylinders=[_cylinder(solid) for solid in solids if solid.kind == "capsule"],
            texts=[_tag(robot, self._team.names.index(robot))] if body == "trunk" else [],
        )

    def terrain(self, tick: int, path: Array) -> fox.SceneUpdate:
        """The ground around a path (F, 3), if it is not flat."""
        ground = self._team.terrain(path)
        if ground is None:
            return fox.SceneUpdate(entities=[])
        points, triangles = ground
        surface = fox.TriangleListPrimitive(
            pose=_pose(),
            color=_color(GROUND),
            indices=triangles.ravel().tolist(),
            points=_points(points),
        )
        entity = fox.SceneEntity(
            timestamp=stamp_of(tick), frame_id=WORLD, id="terrain", triangles=[surface]
        )
        return fox.SceneUpdate(entities=[entity])

    def forces(self, tick: int, grf: Array, planned: Mapping[str, Array]) -> fox.SceneUpdate:
        """Yokes as lines, forces on the feet as arrows.

        Args:
            tick: when, ms.
            grf: true contact forces (n, 4, 3), N, world: arrows in the robots' colours.
            planned: forces (12,), N, yaw frame, of the robots that have a plan: thinner arrows.
        """
        anchors = self._team.anchors()
        lines = fox.LinePrimitive(
            type=fox.LinePrimitiveLineType.LineList,
            pose=_pose(),
            thickness=0.02,
            points=_points(anchors[[i for pair in self._team.yokes for i in pair]]),
            color=_color(YOKE),
        )
        colours = [robot_rgb(index) for index in range(len(self._team.names))]
        plans = self._team.ground_forces(planned)
        arrows = {
            "forces": self._arrows(grf, colours, _THICK),
            PLANNED_NAME: self._arrows(plans, [PLANNED] * len(colours), _THIN),
        }
        stamp = stamp_of(tick)
        return fox.SceneUpdate(
            entities=[
                fox.SceneEntity(timestamp=stamp, frame_id=WORLD, id="yokes", lines=[lines]),
                *(
                    fox.SceneEntity(timestamp=stamp, frame_id=WORLD, id=name, arrows=list(drawn))
                    for name, drawn in arrows.items()
                ),
            ]
        )

    def _arrows(
        self, forces: Array, colours: Sequence[Rgb], thickness: float
    ) -> Iterator[fox.ArrowPrimitive]:
        """Arrows from the feet along forces (n, 4, 3), in one colour for each robot."""
        feet = self._team.feet()
        for robot, leg in np.ndindex(forces.shape[:2]):
            force = forces[robot, leg]
            size = float(np.linalg.norm(force))
            if size >= LEAST:
                length = NEWTON * size
                yield fox.ArrowPrimitive(
                    pose=_pose(feet[robot, leg], _along(force / size)),
                    shaft_length=0.8 * length,
                    shaft_diameter=thickness,
                    head_length=0.2 * length,
                    head_diameter=2.5 * thickness,
                    color=_color(colours[robot]),
                )


def _surface(mesh: LinkMesh) -> fox.TriangleListPrimitive:
    return fox.TriangleListPrimitive(
        pose=_pose(),
        color=_color(mesh.rgba),
        indices=mesh.faces.ravel().tolist(),
        points=_points(mesh.vertices),
    )


def _cube(solid: Solid) -> fox.CubePrimitive:
    pose = _pose(solid.position, solid.quat_wxyz)
    return fox.CubePrimitive(pose=pose, size=_vector(2 * solid.size), color=_color(solid.rgba))


def _sphere(solid: Solid) -> fox.SpherePrimitive:
    size = _vector(np.full(3, 2 * solid.size[0]))
    return fox.SpherePrimitive(pose=_pose(solid.position), size=size, color=_color(solid.rgba))


def _cylinder(solid: Solid) -> fox.CylinderPrimitive:
    """A capsule as the cylinder between its ends."""
    radius, half = solid.size[:2]
    return fox.CylinderPrimitive(
        pose=_pose(solid.position, solid.quat_wxyz),
        size=_vector(np.array([2 * radius, 2 * radius, 2 * half])),
        bottom_scale=1.0,
        top_scale=1.0,
        color=_color(solid.rgba),
    )


def _tag(robot: str, index: int) -> fox.TextPrimitive:
    """A robot's name over its trunk, which faces whoever looks."""
    return fox.TextPrimitive(
        pose=_pose((0.0, 0.0, TAG)),
        billboard=True,
        font_size=_FONT,
        color=_color(robot_rgb(index)),
        text=robot,
    )


def stamp_of(tick: int) -> fox.Timestamp:
    """World time as Foxglove's timestamp: seconds since 1970 are seconds since the start."""
    return fox.Timestamp(sec=tick // 1000, nsec=tick % 1000 * 1_000_000)


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


def _points(values: Any) -> list[fox.Point3]:
    """Points of shape (k, 3)."""
    return [fox.Point3(x=x, y=y, z=z) for x, y, z in values.tolist()]


def _color(rgba: Sequence[float]) -> fox.Color:
    """Of red, green, blue and, unless opaque, opacity, 0 … 1."""
    red, green, blue, *rest = rgba
    return fox.Color(r=red, g=green, b=blue, a=rest[0] if rest else 1.0)
