"""The contact sheet without OpenGL: the team as lines in perspective."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from quadriga.pictures.frames import FRAME, save_sheet, sheet_ticks
from quadriga.pictures.poses import PosedTeam, read_poses, truth_ticks
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robot.conventions import Array

_DPI: Final = 100
_CORNERS: Final = 0.5 * np.array([[1, 1, 0], [1, -1, 0], [-1, -1, 0], [-1, 1, 0], [1, 1, 0]])


def draw_stick_figures(run_dir: Path) -> None:
    """Write the contact sheet of the run in `run_dir`.

    Raises:
        RecordingError: the recording is missing, empty or holds no truth.
    """
    recording = Recording(run_dir / "run.mcap")
    ticks = sheet_ticks(truth_ticks(recording))
    poses = read_poses(recording, ticks)
    team, radius = PosedTeam(poses.config), poses.radius()
    pictures = []
    for qpos, centre in zip(poses.qpos, poses.centre(), strict=True):
        team.set(qpos)
        pictures.append(_picture(team, centre, radius))
    save_sheet(run_dir, ticks, pictures)


def _picture(team: PosedTeam, centre: Array, radius: float) -> Image.Image:
    figure = Figure(figsize=(FRAME[0] / _DPI, FRAME[1] / _DPI), dpi=_DPI)
    canvas: Any = FigureCanvasAgg(figure)
    axes: Any = figure.add_axes((0, 0, 1, 1), projection="3d")
    axes.set_axis_off()
    axes.view_init(elev=22, azim=-35)
    _draw_ground(axes, team, centre, radius)
    trunks = [team.physics.body(f"{name}/trunk") for name in team.names]
    for i, (trunk, legs) in enumerate(zip(trunks, team.legs(), strict=True)):
        colour = team.model.geom(f"{team.names[i]}/trunk").rgba[:3]
        box = np.array(team.config.robot.trunk_box)
        corners = trunk.xpos + (box * _CORNERS) @ trunk.xmat.reshape(3, 3).T
        axes.plot(*corners.T, color=colour, linewidth=3)
        for leg in legs:
            axes.plot(*leg.T, color="0.25", linewidth=1.5, marker=".", markersize=3)
    for i, j in team.team.yokes:
        rod = np.array([trunks[i].xpos, trunks[j].xpos])
        axes.plot(*rod.T, color="goldenrod", linewidth=1.5)
    half = 0.75 * radius
    axes.set(
        xlim=(centre[0] - half, centre[0] + half),
        ylim=(centre[1] - half, centre[1] + half),
        zlim=(-0.2 * half, 0.8 * half),
    )
    axes.set_box_aspect((2, 2, 1), zoom=1.5)
    canvas.draw()
    return Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")


def _draw_ground(axes: Any, team: PosedTeam, centre: Array, radius: float) -> None:
    """Height of the terrain as lines every 0.25 m that stay where they are as the team passes."""
    low, high = (np.floor((centre[:2] + side * radius) / 0.25) * 0.25 for side in (-1, 1))
    along = [np.arange(low[k], high[k] + 1e-9, 0.05) for k in (0, 1)]
    style = {"color": "0.8", "linewidth": 0.6}
    for x in np.arange(low[0], high[0] + 1e-9, 0.25):
        line = np.full_like(along[1], x)
        axes.plot(line, along[1], team.team.terrain.height(line, along[1]), **style)
    for y in np.arange(low[1], high[1] + 1e-9, 0.25):
        line = np.full_like(along[0], y)
        axes.plot(along[0], line, team.team.terrain.height(along[0], line), **style)
