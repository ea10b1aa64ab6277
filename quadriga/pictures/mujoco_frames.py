"""Frames of a run drawn by MuJoCo without a window.

Run as a process of its own (`python -m quadriga.pictures.mujoco_frames RUN_DIR`): MuJoCo chooses
its OpenGL from MUJOCO_GL when it is imported, and nothing else should be drawn that way.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, Final

import mujoco
import numpy as np
from PIL import Image

from quadriga.pictures.frames import FRAME, clip_ticks, save_clip, save_sheet, sheet_ticks
from quadriga.pictures.link_mesh import LinkMeshes
from quadriga.pictures.meshes import link_meshes
from quadriga.pictures.name_tags import write_names
from quadriga.pictures.poses import PosedTeam, Poses, read_poses, truth_ticks
from quadriga.pictures.robot_shapes import dress
from quadriga.pictures.viewpoint import AZIMUTH, ELEVATION, FIELD, viewpoints
from quadriga.shared.errors import MeshError, QuadrigaError
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.colours import robot_rgb
from quadriga.shared.robots.conventions import Array, robot_names
from quadriga.sim_server.terrain.terrain import Stones

_FORCE_SCALE: Final = 0.005  # m per N
_FORCE_RADIUS: Final = 0.008  # m
_FORCE_OPACITY: Final = 0.9
_STREWN: Final = 0.3  # m around the team in which loose stones are drawn
_COARSE: Final = (10, 6)  # facets around and along a round body
# Shadow map [texels] and samples per pixel: what a frame's time goes into.
_SHEET_QUALITY: Final = (1024, 4)
_CLIP_QUALITY: Final = (512, 0)


def draw(run_dir: Path) -> None:
    """Write contact sheet and clip of the run in `run_dir`.

    One line is printed if the robots' meshes are missing, so that they are boxes and capsules.

    Raises:
        RecordingError: the recording is missing or holds no truth.
    """
    recording = Recording(run_dir / "run.mcap")
    ticks = truth_ticks(recording)
    meshes: LinkMeshes = {}
    try:
        meshes = link_meshes(recorded_config(recording).robot.urdf_path())
    except MeshError as error:
        print(f"robots are drawn as boxes and capsules: {error}", flush=True)
    for wanted, quality, save in (
        (sheet_ticks(ticks), _SHEET_QUALITY, save_sheet),
        (clip_ticks(ticks), _CLIP_QUALITY, save_clip),
    ):
        poses = read_poses(recording, wanted)
        save(run_dir, wanted, list(frames(poses, quality, meshes)))


def frames(poses: Poses, quality: tuple[int, int], meshes: LinkMeshes) -> Iterator[Image.Image]:
    """One picture of the team for each pose, the camera moving along.

    Args:
        poses: of all bodies.
        quality: size of the shadow map, texels, and samples of a pixel.
        meshes: what the robots look like; where empty, boxes and capsules.
    """
    team = PosedTeam(
        poses.config, partial(dress, robots=robot_names(poses.config.team.robots), meshes=meshes)
    )
    team.model.vis.quality.shadowsize, team.model.vis.quality.offsamples = quality
    terrain = team.team.terrain
    if terrain.loose:  # thousands of stones
        team.model.vis.quality.numslices, team.model.vis.quality.numstacks = _COARSE
    _light(team.model, 3.0 + 2.0 * poses.radius())
    camera = mujoco.MjvCamera()
    camera.azimuth, camera.elevation = AZIMUTH, ELEVATION
    team.model.vis.global_.fovy = FIELD
    renderer = mujoco.Renderer(team.model, FRAME[1], FRAME[0])
    try:
        for k, view in enumerate(viewpoints(poses)):
            team.set(poses.qpos[k])
            team.physics.light_xpos[0, :2] = view.target[:2]
            camera.lookat[:], camera.distance = view.target, view.distance
            renderer.update_scene(team.physics, camera)
            room = renderer.scene.maxgeom - renderer.scene.ngeom
            centre, reach = poses.centre()[k, :2], poses.radius() + _STREWN
            add_stones(renderer.scene, terrain.stones_near(centre, room, reach))
            _add_forces(renderer.scene, team.feet(), poses.grf[k])
            picture = Image.fromarray(renderer.render())
            write_names(picture, team.names, team.trunks(), view)
            yield picture
    finally:
        renderer.close()


def _light(model: Any, height: float) -> None:
    """One wide lamp above the team: shadow maps of a directional light err on far ground."""
    model.light_type[0] = mujoco.mjtLightType.mjLIGHT_SPOT
    model.light_pos[0] = [0.0, 0.0, height]
    model.light_cutoff[0], model.light_exponent[0] = 70.0, 0.0
    model.light_diffuse[0] = 0.3
    model.vis.headlight.ambient[:] = 0.45
    model.vis.headlight.diffuse[:] = 0.4
    model.vis.map.shadowscale = 0.3


def add_stones(scene: Any, stones: Stones) -> None:
    """Loose stones, of which there must be no more than the scene has room for."""
    turn = np.zeros(9)
    for pose, half, rgb in zip(*stones, strict=True):
        geom, kind = scene.geoms[scene.ngeom], mujoco.mjtGeom.mjGEOM_ELLIPSOID
        mujoco.mju_quat2Mat(turn, pose[3:])
        rgba = np.array([*rgb, 1.0], dtype=np.float32)
        mujoco.mjv_initGeom(geom, kind, half, pose[:3], turn, rgba)
        scene.ngeom += 1


def _add_forces(scene: Any, feet: Array, grf: Array) -> None:
    """Arrows of the ground reaction forces (n, 4, 3), from each foot upwards."""
    for robot, leg in np.ndindex(grf.shape[:2]):
        foot, force = feet[robot, leg], grf[robot, leg]
        if np.linalg.norm(force) < 1.0 or scene.ngeom >= scene.maxgeom:
            continue
        geom, kind = scene.geoms[scene.ngeom], mujoco.mjtGeom.mjGEOM_ARROW
        rgba = np.array([*robot_rgb(robot), _FORCE_OPACITY], dtype=np.float32)
        mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.zeros(9), rgba)
        mujoco.mjv_connector(geom, kind, _FORCE_RADIUS, foot, foot + _FORCE_SCALE * force)
        scene.ngeom += 1


if __name__ == "__main__":
    try:
        draw(Path(sys.argv[1]))
    except QuadrigaError as error:
        sys.exit(str(error))
