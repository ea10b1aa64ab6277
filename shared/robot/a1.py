"""The robot both sides agree on: Unitree A1, leg order, limits, URDF and nominal pose."""

from __future__ import annotations

import importlib.util
from enum import IntEnum
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from quadriga.shared.errors import ConfigError

Array = NDArray[np.float64]


class Leg(IntEnum):
    """Leg order of every array in the project (Pinocchio's, alphabetical by joint name).

    Unitree's SDK uses FR, FL, RR, RL; a bridge to a real robot reorders.
    """

    FL = 0
    FR = 1
    RL = 2
    RR = 3


N_LEGS: Final = 4
N_JOINTS: Final = 12
N_FORCES: Final = 12  # three force components for each of four feet: the planner's input u
OUTPUTS: Final = ("z", "vx", "vy", "roll", "pitch", "wz")  # the planner's output y
N_OUTPUTS: Final = len(OUTPUTS)

JOINT_NAMES: Final = tuple(
    f"{leg.name}_{part}_joint" for leg in Leg for part in ("hip", "thigh", "calf")
)
FOOT_FRAMES: Final = tuple(f"{leg.name}_foot" for leg in Leg)

TORQUE_LIMIT: Final = 33.5  # N·m, every joint (URDF)
FOOT_RADIUS: Final = 0.02  # m
TRUNK_BOX: Final = (0.267, 0.194, 0.114)  # m, full lengths of the trunk's collision box
GRAVITY: Final = 9.81  # m/s²
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


def robot_names(n: int) -> tuple[str, ...]:
    """Names of a team's robots, `r1` … `rn`, in the order of every stacked array."""
    return tuple(f"r{i}" for i in range(1, n + 1))
