"""Frames of a run where there is no OpenGL: triangles painted from the farthest to the nearest."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from PIL import Image, ImageDraw

from quadriga.pictures.frames import FRAME, clip_ticks, save_clip, save_sheet, sheet_ticks
from quadriga.pictures.link_mesh import LinkMesh
from quadriga.pictures.meshes import link_meshes
from quadriga.pictures.name_tags import write_names
from quadriga.pictures.poses import PosedTeam, Poses, read_poses, truth_ticks
from quadriga.pictures.robot_shapes import paint
from quadriga.pictures.viewpoint import Viewpoint, viewpoints
from quadriga.shared.errors import MeshError
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.colours import robot_rgb
from quadriga.shared.robots.conventions import Array
from quadriga.sim_server.world.robot_body import TRUNK

_FINER: Final = 2  # painted larger, then made smaller, so that edges are smooth
_SUN: Final = np.array([0.35, 0.25, 0.9])  # direction to it
_SHADE, _LIGHT = 0.5, 0.5  # of a colour without the sun, and what the sun adds
_SKY: Final = np.array([0.90, 0.93, 0.96])
_TILES: Final = np.array([[0.72, 0.75, 0.74], [0.62, 0.65, 0.64]])
_TILE: Final = 0.25  # m, edge
_GROUND: Final = 4.0  # m around the team; further out it fades into the sky
_YOKE: Final = (216, 166, 33)
_LIMB: Final = (70, 70, 75)
_FORCE: Final = 0.0025  # m per N
_HEAD: Final = 14.0  # pixels, length of an arrow's head at most
_LEAST: Final = 1.0  # N; a smaller force is not drawn


def draw(run_dir: Path) -> str:
    """Write contact sheet and clip of the run in `run_dir`.

    Returns:
        Why robots are boxes and lines; "" if they have their meshes.

    Raises:
        RecordingError: the recording is missing, empty or holds no truth.
    """
    recording, problem = Recording(run_dir / "run.mcap"), ""
    ticks, meshes = truth_ticks(recording), {}
    try:
        meshes = dict(link_meshes(recorded_config(recording).robot.urdf_path()))
    except MeshError as error:
        problem = str(error)
    for wanted, save in ((sheet_ticks(ticks), save_sheet), (clip_ticks(ticks), save_clip)):
        save(run_dir, wanted, list(frames(read_poses(recording, wanted), meshes)))
    return problem


def frames(poses: Poses, meshes: Mapping[str, tuple[LinkMesh, ...]]) -> Iterator[Image.Image]:
    """One picture of the team for each pose, the camera moving along.

    Args:
        poses: of all bodies.
        meshes: of the links; where empty, a trunk is a box and a leg is lines.
    """
    team = PosedTeam(poses.config)
    pieces = _build_pieces(team, meshes)
    width, height = FRAME
    for k, view in enumerate(viewpoints(poses)):
        team.set(poses.qpos[k])
        canvas = Image.new("RGB", (_FINER * width, _FINER * height), _bytes(_SKY))
        draw_on = ImageDraw.Draw(canvas)
        _paint_ground(draw_on, team, view)
        _paint_robots(draw_on, team, pieces, view)
        if not meshes:
            for leg in team.legs().reshape(-1, 4, 3):
                _draw_line(draw_on, view, leg, _LIMB, 6)
        for i, j in team.team.yokes:
            rod = np.array([team.physics.site(f"{team.names[n]}/yoke").xpos for n in (i, j)])
            _draw_line(draw_on, view, rod, _YOKE, 6)
        _draw_forces(draw_on, team, poses.grf[k], view)
        picture = canvas.reduce(_FINER)
        write_names(picture, team.names, team.trunks(), view)
        yield picture


@dataclass(frozen=True, slots=True)
class _Piece:
    """Triangles of one colour on one body: corners (T, 3, 3) in its frame, m."""

    body: int
    corners: Array
    rgb: tuple[float, ...]


def _build_pieces(team: PosedTeam, meshes: Mapping[str, tuple[LinkMesh, ...]]) -> list[_Piece]:
    """All that moves: the robots' surfaces, or their trunks' boxes, and payloads."""
    pieces = []
    for index, robot in enumerate(team.names):
        for body, several in paint(meshes, index).items():
            number = team.model.body(f"{robot}/{body}").id
            pieces += [_Piece(number, m.vertices[m.faces].astype(float), m.rgba) for m in several]
        boxes = ["payload"] if meshes else [TRUNK, "payload"]
        for geom in range(team.model.ngeom):
            body = team.model.body(team.model.geom_bodyid[geom])
            if body.name in [f"{robot}/{name}" for name in boxes]:
                place, size = team.model.geom_pos[geom], team.model.geom_size[geom]
                pieces.append(_Piece(body.id, _box(size) + place, team.model.geom_rgba[geom]))
    return pieces


def _box(half: Array) -> Array:
    """The twelve triangles of a box with these halves of its edges, shape (12, 3, 3)."""
    sides = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            corners = np.zeros((4, 3))
            corners[:, axis] = sign
            corners[:, (axis + 1) % 3] = np.array([-1, 1, 1, -1]) * sign
            corners[:, (axis + 2) % 3] = [-1, -1, 1, 1]
            sides += [corners[[0, 1, 2]], corners[[0, 2, 3]]]
    return np.array(sides) * half


def _paint_robots(
    draw_on: ImageDraw.ImageDraw, team: PosedTeam, pieces: list[_Piece], view: Viewpoint
) -> None:
    """Paint all triangles that face the camera, in the light of the sun."""
    physics = team.physics
    corners = np.concatenate(
        [
            piece.corners @ physics.xmat[piece.body].reshape(3, 3).T + physics.xpos[piece.body]
            for piece in pieces
        ]
    )
    rgb = np.repeat(
        [piece.rgb[:3] for piece in pieces], [len(piece.corners) for piece in pieces], axis=0
    )
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    facing = ((corners[:, 0] - view.eye) * normals).sum(axis=1) < 0.0
    sun = np.clip(normals @ (_SUN / np.linalg.norm(_SUN)), 0.0, 1.0)
    shaded = rgb * (_SHADE + _LIGHT * sun)[:, None]
    _paint(draw_on, corners[facing], shaded[facing], view)


def _paint_ground(draw_on: ImageDraw.ImageDraw, team: PosedTeam, view: Viewpoint) -> None:
    """Paint tiles that stay where they are as the team passes, at the terrain's height."""
    low = np.floor((view.target[:2] - _GROUND) / _TILE).astype(int)
    count = int(2 * _GROUND / _TILE)
    x, y = np.meshgrid(*(_TILE * (low[k] + np.arange(count + 1)) for k in (0, 1)), indexing="ij")
    points = np.stack([x, y, team.team.terrain.height(x, y)], axis=-1)
    tiles = np.stack([points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]], axis=2)
    i, j = np.meshgrid(np.arange(count) + low[0], np.arange(count) + low[1], indexing="ij")
    corners = tiles.reshape(-1, 4, 3)
    away = np.linalg.norm(corners[:, 0, :2] - view.target[:2], axis=1) / _GROUND
    fog = np.clip(away, 0.0, 1.0)[:, None] ** 2
    rgb = (1.0 - fog) * _TILES[(i + j).ravel() % 2] + fog * _SKY
    _paint(draw_on, corners, rgb, view)


def _paint(draw_on: ImageDraw.ImageDraw, corners: Array, rgb: Array, view: Viewpoint) -> None:
    """Paint polygons of K corners (T, K, 3) in their colours (T, 3), the farthest first."""
    many, each = corners.shape[:2]
    places = view.project(corners.reshape(-1, 3)).reshape(many, each, 3)
    depth = places[..., 2]
    order = np.argsort(-depth.mean(axis=1), kind="stable")
    order = order[depth[order].min(axis=1) > 0.0]
    flat = (_FINER * places[order, :, :2]).reshape(len(order), -1).tolist()
    colours = np.rint(255 * np.clip(rgb[order], 0.0, 1.0)).astype(int).tolist()
    for polygon, colour in zip(flat, colours, strict=True):
        draw_on.polygon(polygon, fill=tuple(colour))


def _draw_forces(
    draw_on: ImageDraw.ImageDraw, team: PosedTeam, grf: Array, view: Viewpoint
) -> None:
    """Arrows of the ground reaction forces (n, 4, 3) [N], from each foot upwards."""
    feet = team.feet()
    for robot, leg in np.ndindex(grf.shape[:2]):
        if np.linalg.norm(grf[robot, leg]) >= _LEAST:
            ends = feet[robot, leg] + np.outer([0.0, _FORCE], grf[robot, leg])
            colour = _bytes(np.array(robot_rgb(robot)))
            _draw_line(draw_on, view, ends, colour, 5)
            _draw_head(draw_on, view, ends, colour)


def _draw_line(
    draw_on: ImageDraw.ImageDraw, view: Viewpoint, points: Array, colour: Any, width: int
) -> None:
    """A line through points (k, 3), if all of them are in front of the camera."""
    places = view.project(points)
    if (places[:, 2] > 0.0).all():
        draw_on.line((_FINER * places[:, :2]).ravel().tolist(), fill=colour, width=width)


def _draw_head(draw_on: ImageDraw.ImageDraw, view: Viewpoint, ends: Array, colour: Any) -> None:
    """The head of an arrow between two points (2, 3), if both are in front of the camera."""
    places = view.project(ends)
    if (places[:, 2] > 0.0).all():
        foot, tip = _FINER * places[:, :2]
        along = tip - foot
        length = float(np.linalg.norm(along))
        if length > 1.0:
            back = along / length * min(_HEAD, 0.4 * length)
            side = 0.4 * np.array([-back[1], back[0]])
            corners = np.array([tip, tip - back + side, tip - back - side])
            draw_on.polygon(corners.ravel().tolist(), fill=colour)


def _bytes(rgb: Array) -> tuple[int, ...]:
    return tuple(int(level) for level in np.rint(255 * rgb))
