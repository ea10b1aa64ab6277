"""The trot as a pure function of world time: which feet are scheduled to stand when."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import N_LEGS, Array

# Diagonal pairs in the leg order FL FR RL RR: row 0 stands in the first half cycle.
_BITS = np.array([8, 4, 2, 1])
_PAIRS = np.array([[True, False, False, True], [False, True, True, False]])


def phase_offset_ms(config: Config, index: int) -> int:
    """Shift of robot `index`'s gait: every second robot trots half a period later."""
    return config.gait.stance_ms if config.team.alternate_phase and index % 2 else 0


def scheduled_stance(config: Config, index: int, ticks: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Scheduled stance of robot `index` (0-based) at each tick. Shape (len(ticks), 4)."""
    since = ticks - config.gait.stand_ms
    half_cycle = ((since + phase_offset_ms(config, index)) // config.gait.stance_ms) % 2
    return np.where((since < 0)[:, None], True, _PAIRS[half_cycle])


def stance_progress(config: Config, index: int, tick: int) -> tuple[float, int]:
    """Progress of the present half cycle in [0, 1) and its number, 0 or 1.

    Both half cycles last `stance_ms`: one diagonal pair stands while the other swings.
    """
    since = tick - config.gait.stand_ms + phase_offset_ms(config, index)
    half_cycle, within = divmod(since, config.gait.stance_ms)
    return within / config.gait.stance_ms, half_cycle % 2


def half_cycle_stance(half_cycle: int) -> NDArray[np.bool_]:
    """Scheduled stance during a half cycle; number −1 stands on all four legs. Shape (4,)."""
    return np.ones(N_LEGS, dtype=np.bool_) if half_cycle < 0 else _PAIRS[half_cycle]


def nominal_forces(stance: NDArray[np.bool_], weight: float) -> Array:
    """Forces that carry the robot's weight evenly on its stance feet (the paper's u_des).

    Args:
        stance: scheduled stance, shape (..., 4).
        weight: of the robot, m g, N.

    Returns:
        Shape (..., 12): per leg (0, 0, m g / N_c) for stance legs and zero for swing legs, N.
    """
    forces: Array = nominal_table(weight)[stance @ _BITS]
    return forces


@lru_cache
def nominal_table(weight: float) -> Array:
    """Nominal forces of all 16 stance patterns, by the bits of the legs. Shape (16, 12), N.

    Args:
        weight: of the robot, m g, N.
    """
    stance = np.arange(16)[:, None] & _BITS > 0
    forces = np.zeros((16, N_LEGS, 3))
    forces[..., 2] = stance * weight / np.maximum(stance.sum(axis=1), 1)[:, None]
    table = forces.reshape(16, 3 * N_LEGS)
    table.setflags(write=False)
    return table
