"""Pictures of a finished walk: a contact sheet and a short clip, from the recording alone."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Final

from quadriga.pictures import software_frames
from quadriga.pictures.frames import CLIP, SHEET
from quadriga.shared.runtime.installed import PYTHON
from quadriga.shared.runtime.opengl import environment_to_draw

_TIMEOUT: Final = 120.0  # s


def render(run_dir: Path, say: Callable[[str], None] = print) -> tuple[Path, ...]:
    """Draw the run in `run_dir`; returns the files written.

    MuJoCo draws `walk.png` and `walk.webp` off-screen, in a process of its own that chooses EGL
    unless MUJOCO_GL says otherwise. Where that fails, they are painted without OpenGL, more simply,
    and `say` gets one line about it; likewise where they must do without the robots' meshes.

    Raises:
        RecordingError: the recording is missing, empty or holds no truth.
    """
    problem = _draw_offscreen(run_dir, say)
    if problem:
        without_meshes = software_frames.draw(run_dir)
        say(f"no off-screen OpenGL, so pictures have no shadows: {problem}")
        if without_meshes:
            say(f"robots are drawn as boxes and lines: {without_meshes}")
    return run_dir / SHEET, run_dir / CLIP


def _draw_offscreen(run_dir: Path, say: Callable[[str], None]) -> str:
    """Draw with MuJoCo; the reason why it did not work, or an empty text."""
    command = [*PYTHON, "-m", "quadriga.pictures.mujoco_frames", str(run_dir)]
    try:
        done = subprocess.run(
            command,
            env=environment_to_draw(),
            capture_output=True,
            text=True,
            errors="replace",
            timeout=_TIMEOUT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"nothing drawn after {_TIMEOUT:g} s"
    if done.returncode == 0:
        for line in done.stdout.splitlines():
            say(line)
        return ""
    lines = done.stderr.strip().splitlines()
    return lines[-1] if lines else f"exit status {done.returncode}"
