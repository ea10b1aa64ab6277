"""The robots of a MuJoCo world get the looks of their meshes; nothing else about it changes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import mujoco

from quadriga.pictures.link_mesh import LinkMesh, LinkMeshes
from quadriga.shared.robot.conventions import FOOT_FRAMES
from quadriga.sim_server.terrain.contact import NO_CONTACT
from quadriga.sim_server.world.robot_body import VISUAL_GROUP

_HIDDEN_GROUP: Final = 3  # which MuJoCo draws only on demand


def dress(spec: mujoco.MjSpec, robots: Sequence[str], meshes: LinkMeshes) -> None:
    """Show robots as meshes instead of as boxes, capsules and balls, which stay, unseen.

    The trunk's largest surface takes the colour that its box has, by which robots are told apart.

    Args:
        spec: the world of a team, not yet compiled.
        robots: names of the robots.
        meshes: of each link, in the link's frame; without any, the world stays as it is.
    """
    if not meshes:
        return
    for link, several in meshes.items():
        for k, mesh in enumerate(several):
            _add_mesh(spec, f"{link}.{k}", mesh)
    for robot in robots:
        hull = list(spec.geom(f"{robot}/trunk").rgba)
        for name in (*meshes, *FOOT_FRAMES):
            for geom in _body(spec, robot, name).geoms:
                geom.group = _HIDDEN_GROUP
        for link, several in meshes.items():
            body = _body(spec, robot, link)
            for k, mesh in enumerate(several):
                body.add_geom(
                    type=mujoco.mjtGeom.mjGEOM_MESH,
                    meshname=f"{link}.{k}",
                    rgba=hull if body.name == f"{robot}/trunk" and k == 0 else mesh.rgba,
                    mass=0.0,
                    group=VISUAL_GROUP,
                    **NO_CONTACT,
                )


def _body(spec: mujoco.MjSpec, robot: str, link: str) -> mujoco.MjsBody:
    """A robot's body of a link; the trunk's is called `trunk`, whatever the URDF calls the link."""
    return spec.body(f"{robot}/{link}") or spec.body(f"{robot}/trunk")


def _add_mesh(spec: mujoco.MjSpec, name: str, mesh: LinkMesh) -> None:
    spec.add_mesh(
        name=name,
        uservert=mesh.vertices.ravel(),
        userface=mesh.faces.ravel(),
        # Nothing is made of it, but a surface that is not closed has no volume to compute it from.
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )
