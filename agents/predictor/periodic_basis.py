"""What a periodic predictor is written in: functions of the gait's phase, and net wrenches."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.polynomial import legendre

from quadriga.agents.predictor.episode import Episode
from quadriga.agents.predictor.predictor import PredictorMeta
from quadriga.shared.robot.conventions import N_FORCES, N_LEGS, Array
from quadriga.shared.robot.robots import ROBOTS
from quadriga.shared.wire.topics import SAMPLE_MS

N_WRENCH: Final = 6  # fx, fy, fz, mx, my, mz
_FORCE_SCALE: Final = 40.0  # N: two stance feet with 20 N each
_ROUNDING: Final = 1e-6  # rad: an angle this much before a half begins is meant to be its begin


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


def polynomials(angle: Array, degree: int) -> Array:
    """Legendre polynomials in each half of the gait's period, orthonormal over the period.

    Other feet stand in the other half: what a force does jumps from one half to the other.

    Args:
        angle: θ, the gait's phase as an angle, any shape, rad.
        degree: of the highest polynomial.

    Returns:
        Shape (*angle.shape, 2 degree + 2): those of the first half, then those of the second; each
        is zero in the other half.
    """
    turned = np.mod(angle + _ROUNDING, 2.0 * np.pi)
    half = (turned >= np.pi).astype(int)
    within = 2.0 * (turned - np.pi * half) / np.pi - 1.0
    size = np.sqrt(2.0 * (2.0 * np.arange(degree + 1) + 1.0))
    values = legendre.legvander(within, degree) * size
    second = half[..., None] == 1
    return np.concatenate([np.where(second, 0.0, values), np.where(second, values, 0.0)], axis=-1)


def shift_polynomials(degree: int, angle: float) -> Array:
    """M with polynomials(θ + angle) = polynomials(θ) M wherever both lie in the same half."""
    inside = np.linspace(0.1, np.pi - angle - 0.1, 4 * (degree + 1))
    theta = np.concatenate([inside, np.pi + inside])
    now, later = polynomials(theta, degree), polynomials(theta + angle, degree)
    M: Array = np.linalg.lstsq(now, later)[0].astype(np.float64)
    return M


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
