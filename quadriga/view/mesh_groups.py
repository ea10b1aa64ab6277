"""Which links look alike, so that a browser draws all of them at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from quadriga.pictures.link_mesh import LinkMesh, LinkMeshes


class MeshGroup(NamedTuple):
    """A surface, and the links of each robot that have it.

    Attributes:
        mesh: in the frame of each of these links.
        links: their indices in `Skeleton.links`, ascending.
        is_hull: whether it is the trunk's largest surface, by whose colour robots are told apart.
    """

    mesh: LinkMesh
    links: tuple[int, ...]
    is_hull: bool


def group_meshes(meshes: LinkMeshes, links: Sequence[str]) -> tuple[MeshGroup, ...]:
    """The surfaces of some links without repetition.

    Args:
        meshes: by the URDF's names of links; one that is not among `links` is the trunk.
        links: names, the trunk's first.
    """
    groups: dict[tuple[bytes, bytes, object], MeshGroup] = {}
    for name, several in meshes.items():
        index = links.index(name) if name in links else 0
        for k, mesh in enumerate(several):
            is_hull = index == 0 and k == 0
            same = mesh.vertices.tobytes(), mesh.faces.tobytes(), mesh.rgba
            before = groups.get(same)
            together = (index,) if before is None else (*before.links, index)
            groups[same] = MeshGroup(mesh, tuple(sorted(together)), is_hull)
    return tuple(groups.values())
