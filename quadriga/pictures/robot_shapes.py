"""The robots of a MuJoCo world get the looks of their meshes; nothing else about it changes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import mujoco

from quadriga.pictures.link_mesh import LinkMesh, LinkMeshes
from quadriga.shared.robots.colours import robot_rgb
from quadriga.shared.robots.conventions import FOOT_FRAMES, Leg
from quadriga.sim_server.terrain.terrain import NO_CONTACT
from quadriga.sim_server.world.robot_body import TRUNK, VISUAL_GROUP

HIDDEN_GROUP: Final = 3  # which MuJoCo draws only on demand
_LIMBS: Final = {f"{leg.name}_{part}" for leg in Leg for part in ("hip", "thigh", "calf")}


def paint(meshes: LinkMeshes, robot: int) -> dict[str, tuple[LinkMesh, ...]]:
    """The meshes of a robot by the world's bodies, `trunk`, `FL_hip` and so on.

    The trunk's largest surface gets the robot's colour, by which robots are told apart. The trunk
    is called that, whatever the URDF calls its link.

    Args:
        meshes: by link.
        robot: its place in the team.
    """
    painted: dict[str, tuple[LinkMesh, ...]] = {}
    for link, several in meshes.items():
        body = link if link in _LIMBS else TRUNK
        if body == TRUNK:
            hull = replace(several[0], rgba=(*robot_rgb(robot), 1.0))
            several = (hull, *several[1:])
        painted[body] = (*painted.get(body, ()), *several)
    return painted


def dress(spec: mujoco.MjSpec, robots: Sequence[str], meshes: LinkMeshes) -> None:
    """Show robots as meshes instead of as boxes, capsules and balls, which stay, unseen.

    Args:
        spec: the world of a team, not yet compiled.
        robots: names of the robots, in the team's order.
        meshes: of each link, in the link's frame; without any, the world stays as it is.
    """
    if not meshes:
        return
    for body, several in paint(meshes, 0).items():
        for k, mesh in enumerate(several):
            _add_mesh(spec, f"{body}.{k}", mesh)
    for index, robot in enumerate(robots):
        painted = paint(meshes, index)
        for name in (*painted, *FOOT_FRAMES):
            for geom in spec.body(f"{robot}/{name}").geoms:
                geom.group = HIDDEN_GROUP
        for name, several in painted.items():
            for k, mesh in enumerate(several):
                spec.body(f"{robot}/{name}").add_geom(
                    type=mujoco.mjtGeom.mjGEOM_MESH,
                    meshname=f"{name}.{k}",
                    rgba=mesh.rgba,
                    mass=0.0,
                    group=VISUAL_GROUP,
                    **NO_CONTACT,
                )


def _add_mesh(spec: mujoco.MjSpec, name: str, mesh: LinkMesh) -> None:
    spec.add_mesh(
        name=name,
        uservert=mesh.vertices.ravel(),
        userface=mesh.faces.ravel(),
        # Nothing is made of it, but a surface that is not closed has no volume to compute it from.
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )
