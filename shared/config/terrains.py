"""The table of terrains: what they are called, which keys shape them and who builds them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final


@dataclass(frozen=True, slots=True)
class TerrainKind:
    """One row of the table."""

    name: str  # what `world.terrain` calls it
    builder: str  # `module:function` of the package `quadriga.sim_server.terrain`; "" of a plane
    text: str  # how events and reports describe it, keys of `[world]` in braces
    meaning: str = ""  # what neither its name nor its keys say
    height_key: str = "terrain_height"  # of `[world]`; at 0 the ground is a plane
    least_height: float = 0.0  # that it may be, m


_H: Final = "up to {terrain_height:g} m"
_ROWS: Final = (
    TerrainKind("flat", "", "flat"),
    TerrainKind("boxes", "ground:build_blocks", f"boxes {_H}"),
    TerrainKind("gravel", "ground:build_gravel", f"gravel {_H}", "fixed stones"),
    TerrainKind("heightfield", "ground:build_smooth_field", f"heightfield {_H}"),
    TerrainKind(
        "pebbles",
        "pebbles:build_pebbles",
        f"pebbles {_H}",
        "a layer of loose stones",
        least_height=0.005,  # the ground holds millions of smaller stones
    ),
    TerrainKind("slope", "ground:build_ramps", "slope of {slope:g} deg " + _H, "ramps up and down"),
    TerrainKind(
        "stairs",
        "ground:build_stairs",
        "stairs, {stairs_count} steps of {stairs_rise:g} m up and down, {stairs_run:g} m deep",
        meaning="up, a landing, and down again",
        height_key="stairs_rise",
    ),
)
TERRAINS: Final[Mapping[str, TerrainKind]] = MappingProxyType({row.name: row for row in _ROWS})


def terrain_meanings() -> str:
    """What the names of terrains do not say, as the key's documentation has it."""
    return "; ".join(f"{row.name}: {row.meaning}" for row in _ROWS if row.meaning)
