"""The shapes of a robot's links: the meshes of its URDF, decimated, and kept in the cache."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Final

from quadriga.pictures.link_mesh import Decimation, LinkMeshes, read_meshes, write_meshes
from quadriga.pictures.urdf_visuals import MeshVisual, mesh_visuals
from quadriga.shared.errors import MeshError
from quadriga.shared.runtime.places import cache_file

SETTINGS: Final = Decimation()
_LIBRARIES: Final = ("trimesh", "pycollada", "fast-simplification")
_MAKING: Final = 1  # how meshes are made and written; another number forgets those in the cache


def link_meshes(urdf: Path) -> LinkMeshes:
    """Meshes of the links that move or carry one that moves, the largest of a link first.

    Feet, cameras and whatever else is fixed to such a link are part of it. Meshes are made once for
    each state of the URDF and of its mesh files, which takes seconds, and come out of the cache
    after that.

    Raises:
        MeshError: the URDF or one of its mesh files is missing or cannot be read.
    """
    visuals = mesh_visuals(urdf)
    path = cache_file("meshes", _key(urdf, visuals))
    with suppress(MeshError):  # none yet, or damaged
        return read_meshes(path)
    # Imported here, for it takes most of a second that all pictures but the first can do without.
    from quadriga.pictures.decimation import decimate

    meshes = decimate(visuals, SETTINGS)
    with suppress(OSError):  # without a cache they are made each time
        write_meshes(path, meshes)
    return meshes


def _key(urdf: Path, visuals: Mapping[str, tuple[MeshVisual, ...]]) -> str:
    """Digest of all that the meshes depend on."""
    files = sorted({visual.path for several in visuals.values() for visual in several})
    try:
        digests = [hashlib.sha256(path.read_bytes()).hexdigest() for path in (urdf, *files)]
    except OSError as error:
        raise MeshError(f"meshes of {urdf.name}", str(error), "files that can be read") from None
    libraries = {name: version(name) for name in _LIBRARIES}
    parts = json.dumps([_MAKING, asdict(SETTINGS), libraries, digests], sort_keys=True)
    return hashlib.sha256(parts.encode()).hexdigest()[:16]
