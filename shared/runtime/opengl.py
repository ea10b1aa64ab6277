"""OpenGL, which MuJoCo loads when it is imported: only what draws pictures needs it."""

from __future__ import annotations

import os
from typing import Final

_CHOICE: Final = "MUJOCO_GL"  # read by MuJoCo when it is imported
_ASIDE: Final = "QUADRIGA_MUJOCO_GL"  # what it was before it was set aside
_OFF_SCREEN: Final = "egl"


def do_without_opengl() -> None:
    """From now on MuJoCo loads no OpenGL in this process and those that it starts.

    So a choice that this computer does not have ends no walk.
    """
    os.environ.setdefault(_ASIDE, os.environ.get(_CHOICE, _OFF_SCREEN))
    os.environ[_CHOICE] = "disable"


def environment_to_draw() -> dict[str, str]:
    """The environment of a process that draws: with the user's choice, or else EGL."""
    choice = os.environ.get(_ASIDE) or os.environ.get(_CHOICE) or _OFF_SCREEN
    return {name: text for name, text in os.environ.items() if name != _ASIDE} | {_CHOICE: choice}
