"""From a robot's mesh files to few triangles for each link.

Importing this takes most of a second: whoever finds the result in the cache need not.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Final

import fast_simplification
import numpy as np
import trimesh
from collada.common import DaeError

from quadriga.pictures.link_mesh import Decimation, LinkMesh, LinkMeshes, Rgba
from quadriga.pictures.urdf_visuals import MeshVisual
from quadriga.shared.errors import MeshError

_UNPAINTED: Final = (0.5, 0.5, 0.5, 1.0)

Surface = tuple[trimesh.Trimesh, Rgba | None]


def decimate(visuals: Mapping[str, tuple[MeshVisual, ...]], settings: Decimation) -> LinkMeshes:
    """Meshes of all links, their triangles shared out by area.

    Raises:
        MeshError: a mesh file cannot be read.
    """
    read = cache(read_surfaces)  # several links show one file
    placed = {
        link: [
            (surface.copy().apply_transform(visual.transform), _colour(visual, rgba))
            for visual in several
            for surface, rgba in read(visual.path)
        ]
        for link, several in visuals.items()
    }
    whole = sum(surface.area for surfaces in placed.values() for surface, _ in surfaces)
    return {
        link: _join(
            (_simplify(surface, surface.area / whole, settings), rgba) for surface, rgba in surfaces
        )
        for link, surfaces in placed.items()
    }


def read_surfaces(path: Path) -> tuple[Surface, ...]:
    """The surfaces of a mesh file, one for each colour.

    The file's up axis is not heeded, as in RViz: URDFs are written for that, and a file that says
    `Y_UP` may well have z upwards.

    Raises:
        MeshError: the file cannot be read, or holds no triangles.
    """
    try:
        scene = trimesh.load_scene(path)
        linear = path.suffix.lower() == ".dae"
        surfaces = tuple(_surface(scene, node, linear) for node in scene.graph.nodes_geometry)
    except (OSError, ValueError, LookupError, TypeError, AttributeError, DaeError) as error:
        raise _unreadable(path, str(error) or type(error).__name__) from None
    if not sum(len(surface.faces) for surface, _ in surfaces):
        raise _unreadable(path, "no triangles")
    return surfaces


def _surface(scene: trimesh.Scene, node: str, linear: bool) -> Surface:
    """One geometry of a file, where the file's tree of nodes has it.

    Args:
        scene: the file.
        node: of the geometry.
        linear: whether the file's colours are linear light, as Blender writes them into Collada.
    """
    transform, name = scene.graph[node]
    geometry = scene.geometry[name]
    bare = trimesh.Trimesh(geometry.vertices, geometry.faces, process=False)
    material = getattr(geometry.visual, "material", None)
    if material is None:
        return bare.apply_transform(transform), None
    red, green, blue, alpha = (np.array(material.main_color) / 255.0).tolist()
    if linear:
        red, green, blue = map(_to_srgb, (red, green, blue))
    return bare.apply_transform(transform), (red, green, blue, alpha)


def _colour(visual: MeshVisual, rgba: Rgba | None) -> Rgba:
    """Of a surface that its file gives the colour `rgba`, if any.

    The URDF decides if it names the material. One without a name, often white, comes from exporters
    and knows less than the file.
    """
    if visual.rgba is not None and (visual.named or rgba is None):
        return visual.rgba
    return rgba or _UNPAINTED


def _to_srgb(light: float) -> float:
    """Linear light, 0 … 1, as screens and URDFs count it."""
    return 12.92 * light if light <= 0.0031308 else 1.055 * light ** (1 / 2.4) - 0.055


def _simplify(surface: trimesh.Trimesh, share: float, settings: Decimation) -> trimesh.Trimesh:
    """The surface with about its share of triangles, or as it is if it has no more than that."""
    triangles = max(round(settings.triangles * share), settings.fewest)
    if len(surface.faces) <= triangles:
        return surface
    merged = _merge_close_vertices(surface, settings.cell)
    if len(merged.faces) <= triangles:
        return merged
    vertices, faces = fast_simplification.simplify(
        merged.vertices,
        merged.faces.astype(np.int32),
        target_count=triangles,
        agg=settings.haste,
        preserve_border=True,
    )
    return trimesh.Trimesh(vertices, faces, process=False)


def _merge_close_vertices(surface: trimesh.Trimesh, edge: float) -> trimesh.Trimesh:
    """The surface with one vertex, the mean, for all vertices in a cube with this edge, m.

    Meshes from construction drawings have slivers, doubled walls and edges of three triangles, at
    which the decimation by quadrics stops or goes astray. This leaves none of them.
    """
    cells = np.floor((surface.vertices - surface.bounds[0]) / edge).astype(np.int64)
    row = np.ravel_multi_index(tuple(cells.T), tuple(cells.max(axis=0) + 1))
    _, cell, count = np.unique(row, return_inverse=True, return_counts=True)
    sums = [np.bincount(cell, coordinate) for coordinate in surface.vertices.T]
    merged = trimesh.Trimesh((np.array(sums) / count).T, cell[surface.faces], process=False)
    corners = np.sort(merged.faces, axis=1)
    merged.update_faces((np.diff(corners, axis=1) > 0).all(axis=1) & merged.unique_faces())
    merged.remove_unreferenced_vertices()
    return merged


def _join(surfaces: Iterable[tuple[trimesh.Trimesh, Rgba]]) -> tuple[LinkMesh, ...]:
    """One mesh for each colour, the largest first; what is smaller than a cell has vanished."""
    by_colour: defaultdict[Rgba, list[trimesh.Trimesh]] = defaultdict(list)
    for surface, rgba in surfaces:
        if len(surface.faces):
            by_colour[rgba].append(surface)
    largest_first = sorted(
        by_colour.items(), key=lambda item: sum(part.area for part in item[1]), reverse=True
    )
    return tuple(_link_mesh(several, rgba) for rgba, several in largest_first)


def _link_mesh(surfaces: list[trimesh.Trimesh], rgba: Rgba) -> LinkMesh:
    """One mesh of several surfaces."""
    starts = np.cumsum([0, *(len(surface.vertices) for surface in surfaces)])
    faces = [surface.faces + start for surface, start in zip(surfaces, starts, strict=False)]
    return LinkMesh(
        np.concatenate([surface.vertices for surface in surfaces]).astype(np.float32),
        np.concatenate(faces).astype(np.int32),
        rgba,
    )


def _unreadable(path: Path, reason: str) -> MeshError:
    return MeshError(f"mesh {path}", reason, "a file of triangles", "a damaged file?")
