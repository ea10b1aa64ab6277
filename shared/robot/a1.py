"""Unitree A1: limits, URDF and nominal pose."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Final

import numpy as np

from quadriga.shared.errors import ConfigError
from quadriga.shared.robot.conventions import N_LEGS, Array

TORQUE_LIMIT: Final = 33.5  # N·m, every joint (URDF)
FOOT_RADIUS: Final = 0.02  # m
TRUNK_BOX: Final = (0.267, 0.194, 0.114)  # m, full lengths of the trunk's collision box
TRUNK_LINK: Final = "trunk"

# The URDF's trunk weighs 6.0 kg (13.741 kg in all); this gives the paper's 12.454 kg.
TRUNK_MASS: Final = 4.713
TOTAL_MASS: Final = 12.454

STAND_HEIGHT: Final = 0.26  # m, trunk origin above the ground
_LINK_LENGTH: Final = 0.2  # m, thigh and calf
_HALF_KNEE: Final = float(np.arccos((STAND_HEIGHT - FOOT_RADIUS) / (2 * _LINK_LENGTH)))


def q_stand() -> Array:
    """Joint angles that put every foot under its hip at `STAND_HEIGHT`. Shape (12,), rad."""
    return np.tile([0.0, _HALF_KNEE, -2.0 * _HALF_KNEE], N_LEGS)


def a1_urdf() -> Path:
    """Path of the A1 URDF that the package example-robot-data installs.

    Raises:
        ConfigError: the package is not installed in this environment.
    """
    spec = importlib.util.find_spec("cmeel")
    roots = [] if spec is None or spec.origin is None else [Path(spec.origin).parent.parent]
    for root in roots:
        path = root.joinpath(
            "cmeel.prefix/share/example-robot-data/robots/a1_description/urdf/a1.urdf"
        )
        if path.is_file():
            return path
    raise ConfigError(
        "A1 robot description",
        "no a1.urdf",
        "the file of the package example-robot-data",
        "install the project's dependencies with `make install`",
    )
