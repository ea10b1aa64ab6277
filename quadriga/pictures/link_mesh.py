"""Meshes of a robot's links, in memory and in a file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadriga.shared.errors import MeshError
from quadriga.shared.runtime.atomic import atomic_write
from quadriga.shared.runtime.npz import UNREADABLE, open_npz

Rgba = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class LinkMesh:
    """The triangles of one colour of a link.

    Attributes:
        vertices: link frame, shape (V, 3), m.
        faces: vertices of each triangle, counter-clockwise seen from outside, shape (F, 3).
        rgba: sRGB, 0 … 1.
    """

    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]
    rgba: Rgba


@dataclass(frozen=True, slots=True)
class Decimation:
    """How coarse meshes are made.

    Attributes:
        triangles: of one robot, shared out by area. Small surfaces and borders of surfaces, which
            stay so that no gaps open between colours, add up to as many.
        fewest: triangles of a surface, however small: fewer show no shape.
        cell: vertices in a cube with this edge become one before quadrics decide, m.
        haste: how fast the threshold of the quadrics grows. The 7 of the package's default is meant
            for coordinates in the hundreds and makes a lump of a leg in metres.
    """

    triangles: int = 6000  # so that ten robots are drawn fast
    fewest: int = 150
    cell: float = 0.002  # smaller than a pixel of a picture
    haste: float = 3.0


LinkMeshes = Mapping[str, tuple[LinkMesh, ...]]  # by link


def write_meshes(path: Path, meshes: LinkMeshes) -> None:
    """Keep meshes; a file half written never has the name `path`.

    Raises:
        OSError: the file cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    arrays: dict[str, Any] = {
        f"{link}.{k}.{name}": np.asarray(getattr(mesh, name))
        for link, several in meshes.items()
        for k, mesh in enumerate(several)
        for name in ("vertices", "faces", "rgba")
    }
    with atomic_write(path) as partial, partial.open("wb") as file:
        np.savez(file, **arrays)


def read_meshes(path: Path) -> LinkMeshes:
    """Meshes from a file.

    Raises:
        MeshError: no such file, or not a file of meshes.
    """
    try:
        with open_npz(path) as archive:
            arrays = {name: archive[name] for name in archive.files}
        meshes: dict[str, list[LinkMesh]] = {}
        for name in arrays:
            link, _, field = name.rsplit(".", 2)
            if field == "vertices":
                meshes.setdefault(link, []).append(_mesh(arrays, name.removesuffix(field)))
    except UNREADABLE as error:
        raise MeshError(
            f"meshes {path}", str(error) or type(error).__name__, "a whole file of meshes"
        ) from None
    return {link: tuple(several) for link, several in meshes.items()}


def _mesh(arrays: Mapping[str, NDArray[Any]], prefix: str) -> LinkMesh:
    red, green, blue, alpha = arrays[f"{prefix}rgba"].tolist()
    return LinkMesh(
        arrays[f"{prefix}vertices"], arrays[f"{prefix}faces"], (red, green, blue, alpha)
    )
