"""What a periodic predictor is written in: harmonics of the gait, net wrenches of the feet."""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.agents.predictor.episode import Episode
from quadriga.agents.predictor.predictor import PredictorMeta
from quadriga.shared.robot.conventions import N_FORCES, N_LEGS, Array
from quadriga.shared.robot.robots import ROBOTS
from quadriga.shared.wire.topics import SAMPLE_MS

N_WRENCH: Final = 6  # fx, fy, fz, mx, my, mz
_FORCE_SCALE: Final = 40.0  # N: two stance feet with 20 N each


def harmonics(angle: Array, order: int) -> Array:
    """1, √2 cos θ, √2 sin θ, …, √2 cos kθ, √2 sin kθ up to k = `order`: orthonormal over a period.

    Args:
        angle: θ, the gait's phase as an angle, any shape, rad.
        order: of the highest harmonic.

    Returns:
        Shape (*angle.shape, 2 order + 1).
    """
    k = np.arange(1, order + 1) * angle[..., None]
    waves = np.sqrt(2.0) * np.stack([np.cos(k), np.sin(k)], axis=-1)
    return np.concatenate(
        [np.ones((*angle.shape, 1)), waves.reshape(*angle.shape, 2 * order)], axis=-1
    )


def phase_angles(meta: PredictorMeta, first_tick: int, count: int) -> Array:
    """Angle of the gait's phase at the starts of samples, the first of which ends at `first_tick`.

    Shape (count,), rad; 0 where the gait begins (`PredictorMeta.stand_ms`).
    """
    starts = first_tick + SAMPLE_MS * (np.arange(count) - 1) - meta.stand_ms
    period = 2 * meta.stance_ms
    angles: Array = 2.0 * np.pi * (starts % period) / period
    return angles


def wrench_map(kind: str) -> Array:
    """From the forces of four feet to their net wrench, in units of `_FORCE_SCALE`.

    Moments are about the point on the ground under the trunk, with the feet under their hips; their
    unit is that of the force times the distance of a foot from this point. So sideways forces alone
    have no moment about the horizontal axes. Shape (6, 12).

    Args:
        kind: of robot, a key of `ROBOTS`.
    """
    feet = ROBOTS[kind].feet_under_hips
    moments = np.zeros((3, N_LEGS, 3))
    moments[0, :, 2] = feet[:, 1]
    moments[1, :, 2] = -feet[:, 0]
    moments[2, :, 0], moments[2, :, 1] = -feet[:, 1], feet[:, 0]
    lever = float(np.linalg.norm(feet, axis=1).mean())
    forces = np.tile(np.eye(3)[:, None], (1, N_LEGS, 1))
    full = np.concatenate([forces, moments / lever]) / _FORCE_SCALE
    return full.reshape(N_WRENCH, N_FORCES)


def wrenches(episode: Episode, meta: PredictorMeta) -> Array:
    """Net wrenches of the force deviations of an episode. Shape (T, n, 6)."""
    return episode.deviations()[0] @ wrench_map(meta.robot).T
