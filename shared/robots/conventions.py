"""What all agree on: names and order of legs, joints, inputs, outputs and robots; their yokes."""

from __future__ import annotations

import itertools
from enum import IntEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

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
GRAVITY: Final = 9.81  # m/s²


def robot_names(n: int) -> tuple[str, ...]:
    """Names of a team's robots, `r1` … `rn`, in the order of every stacked array."""
    return tuple(f"r{i}" for i in range(1, n + 1))


def yoke_pairs(n: int, graph: str) -> tuple[tuple[int, int], ...]:
    """Pairs of robots (0-based) that a yoke connects: `complete`, `chain`, `ring` or `none`."""
    if graph == "none":
        return ()
    if graph == "complete":
        return tuple(itertools.combinations(range(n), 2))
    chain = tuple((i, i + 1) for i in range(n - 1))
    return (*chain, (0, n - 1)) if graph == "ring" and n > 2 else chain


def neighbours(n: int, graph: str, i: int) -> tuple[int, ...]:
    """Robots (0-based) that a yoke connects to robot `i`, in order."""
    return tuple(j for j in range(n) if (min(i, j), max(i, j)) in yoke_pairs(n, graph))
