"""Measures whether what a predictor says of the peers is in data that it has not seen.

No walk is needed twice, so data of real robots will do.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from quadriga.agents.predictor.episode import Episode
from quadriga.agents.predictor.held_out import predict_windows, window_phases
from quadriga.agents.predictor.peers_figures import Bounds, PeersFigures
from quadriga.agents.predictor.predictor import Predictor
from quadriga.shared.robot.conventions import N_OUTPUTS, OUTPUTS, Array

_BLOCK = 100  # windows: 1 s, longer than a window's errors are alike
_TAIL = 0.975  # of the two-sided interval


def peers_figures(
    predictor: Predictor, held_out: Sequence[Episode], harm_limit: float
) -> PeersFigures | None:
    """Figures of the predicted effect of the peers' forces; None for a single robot.

    Args:
        predictor: whose predictions they are of.
        held_out: episodes whose forces have random parts, independent between robots.
        harm_limit: stored with the figures.
    """
    n = predictor.meta.robots
    if n == 1:
        return None
    blocks = np.concatenate([_block_sums(predictor, episode) for episode in held_out])
    pp, pr, rr, own = np.moveaxis(blocks, 1, 0)  # each of shape (blocks, 6)
    share = np.sqrt(
        np.divide(pp.sum(axis=0), (n - 1) * own.sum(axis=0), out=np.full(N_OUTPUTS, np.nan),
                  where=own.sum(axis=0) > 0.0)
    )  # fmt: skip
    slopes, harms = _ratios(pr, pp), _ratios(pp - 2.0 * pr, rr)
    return PeersFigures(
        share={name: _number(share[k]) for k, name in enumerate(OUTPUTS)},
        slope=dict(zip(OUTPUTS, slopes, strict=True)),
        harm=dict(zip(OUTPUTS, harms, strict=True)),
        harm_limit=harm_limit,
    )


def _block_sums(predictor: Predictor, episode: Episode) -> Array:
    """Σ p², Σ p r, Σ r² and Σ (own part)² over each block of windows. Shape (blocks, 4, 6)."""
    meta = predictor.meta
    if episode.samples < meta.T_ini + meta.N:
        return np.zeros((0, 4, N_OUTPUTS))
    z, dy = episode.windows(meta.T_ini, meta.N)
    phases = window_phases(predictor, episode, z.shape[2])
    own, peers = _parts(predictor, phases, z[:, meta.past :])
    rest = dy - predict_windows(predictor, phases, z) + peers
    products = (peers**2, peers * rest, rest**2, own**2)
    by_window = np.array(
        [x.reshape(meta.robots, meta.N, N_OUTPUTS, -1).sum(axis=(0, 1)) for x in products]
    )
    count = max(1, round(z.shape[2] / _BLOCK))
    return np.array([part.sum(axis=2) for part in np.array_split(by_window, count, axis=2)])


def _parts(predictor: Predictor, phases: NDArray[np.int64], u: Array) -> tuple[Array, Array]:
    """Parts of predictions due to a robot's own forces and to its peers', (n, 6 N, C) each.

    Args:
        predictor: of the team.
        phases: of each window, shape (C,).
        u: forces of the horizon, shape (n, 12 N, C).
    """
    n, _, windows = u.shape
    own = np.empty((n, N_OUTPUTS * predictor.meta.N, windows))
    peers = np.zeros_like(own)
    for phase in np.unique(phases):
        now = phases == phase
        for i in range(n):
            for j in range(n):
                part = predictor.future_block(i, j, int(phase)) @ u[j][:, now]
                if i == j:
                    own[i][:, now] = part
                else:
                    peers[i][:, now] += part
    return own, peers


def _ratios(over: Array, under: Array) -> list[Bounds]:
    """Σ over / Σ under of each output, its interval from how much the blocks differ.

    The delta method for a ratio of sums over blocks, with Student's t (Cochran, Sampling
    Techniques, 3rd ed., section 6.3).

    Args:
        over: shape (blocks, 6).
        under: likewise, not negative.
    """
    count, total = len(over), under.sum(axis=0)
    bounds = []
    for k in range(N_OUTPUTS):
        if not total[k] > 0.0:
            bounds.append(Bounds(None, None, None))
            continue
        ratio = float(over[:, k].sum() / total[k])
        if count < 2:
            bounds.append(Bounds(ratio, None, None))
            continue
        spread = ((over[:, k] - ratio * under[:, k]) ** 2).sum() * count / (count - 1)
        reach = float(stdtrit(count - 1, _TAIL) * np.sqrt(spread) / total[k])
        bounds.append(Bounds(ratio, ratio - reach, ratio + reach))
    return bounds


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
