"""Materials of the ground."""

from __future__ import annotations

from typing import Final

import mujoco

PLANE: Final = "plane"
EARTH: Final = "earth"
_Colour = tuple[float, float, float]
_COLOURS: Final[dict[str, tuple[_Colour, _Colour, float]]] = {  # light, dark, edge of a square, m
    PLANE: ((0.80, 0.82, 0.80), (0.70, 0.73, 0.71), 0.5),
    EARTH: ((0.60, 0.54, 0.42), (0.53, 0.47, 0.36), 0.2),
}


def add_checker(spec: mujoco.MjSpec, name: str) -> None:
    """Add one of these materials, made of squares, to a world under construction."""
    light, dark, square = _COLOURS[name]
    spec.add_texture(
        name=name,
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        width=256,
        height=256,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=light,
        rgb2=dark,
    )
    repeat = 0.5 / square  # the texture is two squares wide
    spec.add_material(
        name=name,
        texrepeat=[repeat, repeat],
        texuniform=True,
        textures=["", name],
        specular=0.1,
        shininess=0.1,
    )
