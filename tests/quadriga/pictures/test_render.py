"""Poses come back from the recording; the pictures show them with and without OpenGL."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from quadriga.pictures.frames import FRAME, clip_ticks, sheet_ticks
from quadriga.pictures.poses import PosedTeam, read_poses, truth_ticks
from quadriga.pictures.render import render
from quadriga.pictures.viewpoint import viewpoints
from quadriga.shared import messages as msg
from quadriga.shared.errors import RecordingError
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.a1 import A1
from quadriga.shared.robots.colours import robot_rgb
from quadriga.sim_server.world.layout import NQ
from tests.a1 import FOOT_RADIUS, q_stand
from tests.quadriga.conftest import SPEED, WriteRun, run_config


def test_poses_are_truth_and_joint_angles(known_run: Path) -> None:
    recording = Recording(known_run / "run.mcap")
    ticks = truth_ticks(recording)
    np.testing.assert_array_equal(ticks, np.arange(0, 6001, 10))
    poses = read_poses(recording, ticks[[0, 300]])
    robots = poses.qpos.reshape(2, 2, NQ)
    np.testing.assert_allclose(robots[:, :, 7:], np.broadcast_to(q_stand(), (2, 2, 12)))
    moved = robots[1, :, :2] - robots[0, :, :2]
    np.testing.assert_allclose(np.linalg.norm(moved, axis=1), 3 * SPEED)
    assert poses.radius() == pytest.approx(0.45 + 0.4, abs=0.01)


def test_feet_of_a_standing_team_are_on_the_ground(write_run: WriteRun) -> None:
    run = write_run(run_config(3, 0.5), yaw=0.0)
    recording = Recording(run / "run.mcap")
    poses = read_poses(recording, np.array([0]))
    team = PosedTeam(poses.config)
    team.set(poses.qpos[0])
    feet, legs = team.feet(), team.legs()
    assert feet.shape == (3, 4, 3)
    np.testing.assert_allclose(legs[:, :, 3], feet)
    assert np.abs(feet[0, :, 2] - FOOT_RADIUS).max() < 0.01  # rolled by 0.03 rad
    assert feet[0, 0, 1] > feet[0, 1, 1]  # FL is left of FR
    assert feet[0, 0, 0] > feet[0, 2, 0]  # and ahead of RL


def test_instants_cover_the_run_and_its_end() -> None:
    ticks = np.arange(0, 20_001, 10)
    sheet, clip = sheet_ticks(ticks), clip_ticks(ticks)
    assert (sheet[0], sheet[-1], len(sheet)) == (0, 20_000, 8)
    assert clip[0] == 15_000
    assert set(np.diff(clip)) == {80}
    for few in (ticks[:1], ticks[:3]):
        assert set(sheet_ticks(few)) == set(few)
        assert set(clip_ticks(few)) <= set(few)


def test_renders_sheet_and_clip(write_run: WriteRun) -> None:
    messages: list[str] = []
    run = write_run(run_config(2, 0.5))
    paths = render(run, messages.append)
    with Image.open(paths[0]) as sheet:
        pixels = np.asarray(sheet.convert("RGB")).astype(int)
    assert pixels.shape == (4 * 360 + 3 * 6, 2 * 640 + 6, 3)
    if messages:
        pytest.skip(messages[0])
    picture = Image.fromarray(pixels[: FRAME[1], : FRAME[0]].astype(np.uint8))
    assert_robots_are_where_they_were(picture, run, 0)
    with Image.open(paths[1]) as clip:
        assert clip.size == (640, 360)
        assert getattr(clip, "n_frames", 1) == 7


def test_without_meshes_boxes_and_capsules_and_one_line(
    write_run: WriteRun, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The process that draws finds an installation whose mesh files are missing."""
    robot = "cmeel.prefix/share/example-robot-data/robots/a1_description/urdf"
    (tmp_path / "cmeel").mkdir()
    (tmp_path / "cmeel" / "__init__.py").touch()
    (tmp_path / robot).mkdir(parents=True)
    shutil.copy(A1.urdf_path(), tmp_path / robot)
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{os.environ.get('PYTHONPATH', '')}")
    messages: list[str] = []
    run = write_run(run_config(1, 0.5))
    paths = render(run, messages.append)
    if "OpenGL" in messages[-1]:
        pytest.skip(messages[-1])
    assert [path.name for path in paths] == ["walk.png", "walk.webp"]
    assert len(messages) == 1
    assert "boxes and capsules" in messages[0]
    assert "trunk.dae" in messages[0]


def test_without_opengl_the_same_robots_and_one_line(
    write_run: WriteRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MUJOCO_GL", "disable")
    messages: list[str] = []
    run = write_run(run_config(2, 0.5))
    assert render(run, messages.append) == (run / "walk.png", run / "walk.webp")
    assert len(messages) == 1
    assert "\n" not in messages[0]
    assert "no off-screen OpenGL" in messages[0]
    with Image.open(run / "walk.png") as sheet:
        assert sheet.width == 2 * 640 + 6
        picture = sheet.convert("RGB").crop((0, 0, *FRAME))
    assert_robots_are_where_they_were(picture, run, 0)
    with Image.open(run / "walk.webp") as clip:
        assert getattr(clip, "n_frames", 1) == 7


def test_a_choice_of_opengl_that_there_is_not_ends_no_command(
    write_run: WriteRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MUJOCO_GL", "nonsense")
    run = write_run(run_config(1, 0.5))
    command = [sys.executable, "-m", "quadriga", "report", str(run)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.stderr.startswith("quadriga: the walk: got an end at 0.5 s"), "all else is done"
    assert "invalid value for environment variable MUJOCO_GL: nonsense" in done.stdout + done.stderr
    assert (run / "walk.png").is_file()


def assert_robots_are_where_they_were(picture: Image.Image, run: Path, tick: int) -> None:
    """Each trunk's colour, bright or in the shade, is around where the trunk was."""
    poses = read_poses(Recording(run / "run.mcap"), np.array([tick]))
    pixels = np.asarray(picture).astype(float)
    team = PosedTeam(poses.config)
    team.set(poses.qpos[0])
    for index, (x, y, _) in enumerate(viewpoints(poses)[0].project(team.trunks())):
        colour = np.array(robot_rgb(index))
        level = pixels.max(axis=2, keepdims=True)
        alike = np.abs(pixels / np.maximum(level, 1.0) - colour / colour.max()).max(axis=2) < 0.1
        rows, columns = np.nonzero(alike & (level[..., 0] > 60))
        assert len(rows) > 500
        assert np.hypot(np.median(columns) - x, np.median(rows) - y) < 15


def test_a_recording_without_truth_cannot_be_drawn(write_run: WriteRun) -> None:
    run = write_run(run_config(1, 0.5), change=lambda _, m: None if isinstance(m, msg.Truth) else m)
    with pytest.raises(RecordingError, match="sim/truth"):
        render(run)


def test_a_lost_state_is_shown_standing(write_run: WriteRun) -> None:
    run = write_run(
        run_config(1, 0.5),
        change=lambda _, m: None if isinstance(m, msg.State) and m.tick == 100 else m,
    )
    poses = read_poses(Recording(run / "run.mcap"), np.array([100]))
    np.testing.assert_allclose(poses.qpos[0, 7:], q_stand())
