"""A few responses: what measured responses depend on besides their configuration."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

from quadriga.experiments.probe.measure import measure_robot
from quadriga.shared.config.load import load
from quadriga.shared.robots.conventions import Array

_SHORT: Final = {
    "gait.stand_ms": 100, "reference.ramp": 0.2, "planner.N": 21, "planner.applied": 20,
    "world.seed": 0,
}  # fmt: skip
_TEAMS: Final[tuple[dict[str, Any], ...]] = (
    {"team.robots": 2, "world.terrain": "boxes"},
    {"team.robots": 1, "planner.interface": "force", "controller.preset": "plain"},
)


def samples() -> Iterator[Array]:
    """The responses of two small teams to the pulses of the first robot."""
    for keys in _TEAMS:
        measured = measure_robot(load(None, _SHORT | keys), 0, 0)
        yield from (measured.u, measured.y)
