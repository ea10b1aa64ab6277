"""What a page needs to draw a recorded team from any side, as JSON: shapes once, poses by time.

Numbers are little-endian arrays in base64; `report/scene.js` reads them. Lengths are integers of
16 bits in a unit of their own: 1.6 s of three robots take 78 kB, their shapes 62 kB.
"""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.colors import to_hex
from numpy.typing import NDArray

from quadriga.moving_scene.spans import Span
from quadriga.pictures.link_mesh import LinkMeshes
from quadriga.shared.robots.colours import robot_colour
from quadriga.shared.robots.conventions import Array
from quadriga.view.compose import compose
from quadriga.view.ground import read_boxes, read_surface
from quadriga.view.mesh_groups import group_meshes
from quadriga.view.picture import Picture
from quadriga.view.recorded import RecordedRun
from quadriga.view.team_shape import TeamShape

STEP_MS: Final = 20  # between two pictures
_AROUND: Final = 1.5  # m around the team within which the ground is drawn
_FORCE_UNIT: Final = 0.1  # N
_QUAT_UNIT: Final = 1.0 / 32767.0
_MOST_BOXES: Final = 500


def build_scene(run: RecordedRun, spans: Sequence[Span], meshes: LinkMeshes) -> str:
    """The scene as JSON.

    Args:
        run: the recorded walk.
        spans: what is shown of it, at least one.
        meshes: of the robots' links.
    """
    groups = group_meshes(meshes, run.shape.skeleton.links)
    drawn = sorted({0, *(link for group in groups for link in group.links)})  # 0: the trunk
    films = [_film(run, span) for span in spans]
    corners = np.concatenate([picture.trunk[:, :2] for film in films for picture in film])
    return json.dumps(
        {
            "meshes": [
                {
                    "links": [drawn.index(link) for link in group.links],
                    "colour": "" if group.is_hull else to_hex(group.mesh.rgba[:3]),
                    **_pack_lengths("vertices", np.asarray(group.mesh.vertices)),
                    "faces": _pack(np.asarray(group.mesh.faces), "<u2"),
                }
                for group in groups
            ],
            "robots": [
                {"name": name, "colour": robot_colour(i)} for i, name in enumerate(run.shape.robots)
            ],
            "yokes": [list(pair) for pair in run.shape.yokes],
            "loads": _describe_loads(run.shape),
            **_describe_ground(run.shape, corners),
            "spans": [
                _describe_film(film, span, drawn) for film, span in zip(films, spans, strict=True)
            ],
        },
        separators=(",", ":"),
    )


def _film(run: RecordedRun, span: Span) -> list[Picture]:
    ticks = range(span.first, span.last + 1, STEP_MS)
    return [compose(run.shape, run.snapshot(tick)) for tick in ticks]


def _describe_film(film: Sequence[Picture], span: Span, drawn: Sequence[int]) -> dict[str, Any]:
    """Poses of all pictures of a span, about the place where the team is first."""
    origin = np.append(film[0].centre[:2], 0.0)
    positions = np.array([picture.link_positions[:, drawn] for picture in film]) - origin
    feet = np.array([picture.feet for picture in film]) - origin
    anchors = np.array([picture.anchors for picture in film]) - origin
    unit = max(float(np.abs(part).max()) for part in (positions, feet, anchors)) / 32767.0
    forces = np.array([picture.true_forces for picture in film])
    return {
        "title": span.title,
        "isTruth": film[0].is_truth,
        "first": span.first,
        "step": STEP_MS,
        "pictures": len(film),
        "links": len(drawn),
        "origin": origin.tolist(),
        "unit": unit,
        "positions": _pack(np.rint(positions / unit), "<i2"),
        "quats": _pack(
            np.rint(np.array([p.link_quats[:, drawn] for p in film]) / _QUAT_UNIT), "<i2"
        ),
        "feet": _pack(np.rint(feet / unit), "<i2"),
        "anchors": _pack(np.rint(anchors / unit), "<i2"),
        "contact": _pack(np.array([picture.contact for picture in film]), "u1"),
        "forces": _pack(np.rint(forces / _FORCE_UNIT).clip(-32767, 32767), "<i2"),
    }


def _describe_loads(shape: TeamShape) -> dict[str, Any]:
    carriers, places = shape.loads
    return {"carriers": list(carriers), "places": places.tolist()}


def _describe_ground(shape: TeamShape, corners: Array) -> dict[str, Any]:
    """Boxes and surface of the terrain near where the team is seen, shape (…, 2)."""
    low, high = corners.min(axis=0) - _AROUND, corners.max(axis=0) + _AROUND
    boxes = read_boxes(shape.terrain)
    near = _lie_within(boxes.positions[:, :2], low, high)
    chosen = np.flatnonzero(near)[:_MOST_BOXES]
    rows = np.concatenate([boxes.positions, boxes.quats, boxes.edges], axis=1)[chosen]
    found: dict[str, Any] = {
        "boxes": _pack(rows, "<f4"),
        "boxColours": _pack(boxes.colours[chosen], "u1"),
        "surface": None,
    }
    surface = read_surface(shape.terrain)
    if surface is not None:
        kept = _lie_within(surface.vertices[:, :2], low, high)
        faces = surface.faces[kept[surface.faces].all(axis=1)]
        numbers = np.cumsum(kept) - 1  # of those that are kept
        found["surface"] = {
            "vertices": _pack(surface.vertices[kept], "<f4"),
            "faces": _pack(numbers[faces], "<u4"),
        }
    return found


def _lie_within(points: Array, low: Array, high: Array) -> NDArray[np.bool_]:
    inside: NDArray[np.bool_] = np.all((points >= low) & (points <= high), axis=-1)
    return inside


def _pack_lengths(name: str, values: Array) -> dict[str, Any]:
    """Lengths as integers of 16 bits, and the unit of these."""
    unit = float(np.abs(values).max()) / 32767.0
    return {name: _pack(np.rint(values / unit), "<i2"), "unit": unit}


def _pack(values: NDArray[Any], kind: str) -> str:
    return b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode()
