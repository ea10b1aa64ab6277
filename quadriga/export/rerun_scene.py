"""The scene for Rerun: robots by their meshes, terrain, yokes, forces, paths walked and planned."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import rerun as rr

from quadriga.export.columns import TickReached
from quadriga.export.planned_forces import PlannedForces
from quadriga.export.predicted_path import predict_path
from quadriga.export.rerun_log import RerunLog
from quadriga.export.team_scene import (
    GROUND,
    LEAST,
    NEWTON,
    PERIOD_MS,
    PLANNED,
    TAG,
    YOKE,
    Solid,
    TeamScene,
    path_ticks,
)
from quadriga.pictures.poses import Poses, read_poses
from quadriga.recordings.traces import Traces
from quadriga.recordings.truth import Ticks
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.colours import robot_rgb
from quadriga.shared.robots.conventions import Array

WORLD: Final = "/world"
_THICK, _THIN, _LINE = 0.006, 0.0035, 0.004  # m, radii
_YOKE_RADIUS: Final = 0.01  # m
_FLAT: Final = 1e-12  # m²


def log_scene(log: RerunLog, recording: Recording, traces: Traces, on_tick: TickReached) -> None:
    """Log everything that is seen in space, every `PERIOD_MS` of world time.

    Raises:
        RecordingError: see `read_poses`.
    """
    ticks = path_ticks(np.unique(traces.truth.tick), PERIOD_MS)
    poses, team = read_poses(recording, ticks), TeamScene(traces.config)
    log.keep(WORLD, rr.ViewCoordinates.RIGHT_HAND_Z_UP)
    for index, robot in enumerate(team.names):
        _keep_looks(log, team, robot, index)
    ground = team.terrain(poses.centre())
    if ground is not None:
        log.keep(f"{WORLD}/terrain", _mesh(*ground, (*GROUND, 1.0)))
    _log_motion(log, team, poses, PlannedForces(traces), on_tick)
    for index, robot in enumerate(team.names):
        _log_paths(log, traces, index, f"{WORLD}/{robot}")


def _keep_looks(log: RerunLog, team: TeamScene, robot: str, index: int) -> None:
    """The looks of all links of a robot, and its name over its trunk."""
    for link in team.links:
        if link.startswith(f"{robot}/"):
            for k, mesh in enumerate(team.surfaces(link)):
                log.keep(f"{WORLD}/{link}/{k}", _mesh(mesh.vertices, mesh.faces, mesh.rgba))
            for k, solid in enumerate(team.solids(link)):
                log.keep(f"{WORLD}/{link}/{solid.kind}-{k}", _solid(solid))
    tag = rr.Points3D(
        [[0.0, 0.0, TAG]],
        radii=[0.001],
        colors=[robot_rgb(index)],
        labels=[robot],
        show_labels=True,
    )
    log.keep(f"{WORLD}/{robot}/trunk/name", tag)


def _log_motion(
    log: RerunLog, team: TeamScene, poses: Poses, planned: PlannedForces, on_tick: TickReached
) -> None:
    """Poses of all links, yokes, and forces on all feet."""
    places, turns, anchors, feet, plans = [], [], [], [], []
    for tick, qpos in zip(poses.tick.tolist(), poses.qpos, strict=True):
        team.set(qpos)
        place, turn = team.link_poses()
        places.append(place)
        turns.append(turn)
        anchors.append(team.anchors())
        feet.append(team.feet())
        plans.append(team.ground_forces(planned.at(tick)))
        on_tick(tick)
    moved, turned = np.array(places), np.roll(np.array(turns), -1, axis=-1)  # xyzw
    for k, link in enumerate(team.links):
        columns = rr.Transform3D.columns(translation=moved[:, k], quaternion=turned[:, k])
        log.over_time(f"{WORLD}/{link}", poses.tick, columns)
    if team.yokes:
        rods = np.array(anchors)[:, np.array(team.yokes)]  # (F, k, 2, 3)
        _log_strips(log, f"{WORLD}/yokes", poses.tick, rods, _YOKE_RADIUS, YOKE)
    for index, robot in enumerate(team.names):
        path, there = f"{WORLD}/{robot}/forces", np.array(feet)[:, index]
        colour = robot_rgb(index)
        _log_arrows(log, f"{path}/true", poses.tick, there, poses.grf[:, index], (_THICK, colour))
        plan = np.array(plans)[:, index]
        _log_arrows(log, f"{path}/planned", poses.tick, there, plan, (_THIN, PLANNED))


def _log_paths(log: RerunLog, traces: Traces, index: int, path: str) -> None:
    """The way the trunk went, drawn on the ground, and the way that each plan meant to go."""
    truth, colour = traces.truth, [robot_rgb(index)]
    walked = truth.base_pos[:, index]
    below = walked - np.array([0.0, 0.0, traces.config.robot.stand_height])  # seen under the legs
    log.keep(f"{path}/path/walked", rr.LineStrips3D([below], radii=[_LINE], colors=colour))
    ticks, strips = [], []
    for plan in traces.plans[traces.robots[index]]:
        at = int(np.searchsorted(truth.tick, plan.tick, side="right")) - 1
        if at >= 0 and len(plan.y):
            w, x, y, z = truth.base_quat_wxyz[at, index]
            yaw = float(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
            ticks.append(plan.tick)
            strips.append(predict_path(plan.y, walked[at], yaw))
    lengths = {len(strip) for strip in strips}
    if len(lengths) == 1:  # of one team all plans are equally long
        drawn = np.array(strips)[:, None]
        _log_strips(log, f"{path}/path/planned", np.array(ticks), drawn, _LINE, PLANNED)


def _log_strips(
    log: RerunLog, path: str, ticks: Ticks, strips: Array, radius: float, colour: Any
) -> None:
    """Log lines of shape (F, lines, points, 3)."""
    frames, lines = strips.shape[:2]
    log.keep(path, rr.LineStrips3D.from_fields(radii=[radius], colors=[colour]))
    columns = rr.LineStrips3D.columns(strips=list(strips.reshape(-1, *strips.shape[2:])))
    log.over_time(path, ticks, columns.partition([lines] * frames))


def _log_arrows(
    log: RerunLog, path: str, ticks: Ticks, feet: Array, forces: Array, look: tuple[float, Any]
) -> None:
    """Log arrows of forces (F, 4, 3) [N] on feet (F, 4, 3) [m]; `look` is radius and colour."""
    seen = np.linalg.norm(forces, axis=-1) >= LEAST
    if not seen.any():
        return
    log.keep(path, rr.Arrows3D.from_fields(radii=[look[0]], colors=[look[1]]))
    columns = rr.Arrows3D.columns(vectors=NEWTON * forces[seen], origins=feet[seen])
    log.over_time(path, ticks, columns.partition(seen.sum(axis=1)))


def _mesh(vertices: Any, faces: Any, rgba: tuple[float, ...]) -> rr.Mesh3D:
    return rr.Mesh3D(
        vertex_positions=vertices,
        triangle_indices=faces,
        vertex_normals=_normals(np.asarray(vertices, dtype=float), np.asarray(faces)),
        albedo_factor=rgba,
    )


def _normals(vertices: Array, faces: Any) -> Array:
    """Directions in which the surface looks at each vertex, shape as `vertices`."""
    corners = vertices[faces]
    of_faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(normals, faces[:, corner], of_faces)
    sizes = np.linalg.norm(normals, axis=1)
    normals[sizes < _FLAT] = [0.0, 0.0, 1.0]  # of a thin sheet both sides cancel out
    unit: Array = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    return unit


def _solid(solid: Solid) -> Any:
    w, x, y, z = solid.quat_wxyz.tolist()
    turn, colour = [rr.Quaternion(xyzw=[x, y, z, w])], [solid.rgba]
    filled = rr.components.FillMode.Solid
    centre, size = solid.position, solid.size
    if solid.kind == "box":
        return rr.Boxes3D(
            centers=[centre], half_sizes=[size], quaternions=turn, colors=colour, fill_mode=filled
        )
    if solid.kind == "sphere":
        return rr.Ellipsoids3D(
            centers=[centre], half_sizes=[[size[0]] * 3], colors=colour, fill_mode=filled
        )
    # Rerun's capsule begins at its origin, MuJoCo's has it in the middle.
    axis = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    return rr.Capsules3D(
        lengths=[2 * size[1]],
        radii=[size[0]],
        translations=[centre - size[1] * axis],
        quaternions=turn,
        colors=colour,
        fill_mode=filled,
    )
