"""Regressions of the periodic predictor on a team's episodes: rows, and sums over folds of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.predictor.episode import Y_SCALE, Episode
from quadriga.agents.predictor.periodic_basis import (
    N_WRENCH,
    harmonics,
    phase_angles,
    polynomials,
    wrenches,
)
from quadriga.agents.predictor.predictor import PredictorMeta
from quadriga.shared.robot.conventions import N_OUTPUTS, Array

_SAME: Final = 1e-9  # N: forces that differ by less are held
_COMMANDED: Final = (1, 2, 5)  # vx, vy, wz: outputs whose base moves with the reference


class Walked(NamedTuple):
    """One episode as the regressions see it, scaled.

    Attributes:
        w: net wrenches, (T, n, 6).
        y: outputs, (T, n, 6).
        base: commanded outputs, (T, n, 3).
        angle: of the gait's phase at the sample's start, (T,), rad.
        starts: samples with which a new draw of the force noise begins, in order.
    """

    w: Array
    y: Array
    base: Array
    angle: Array
    starts: NDArray[np.int64]


def scale_episodes(
    episodes: Sequence[Episode], meta: PredictorMeta
) -> tuple[tuple[Walked, ...], int]:
    """The episodes scaled, and for how many samples their forces are held."""
    hold = _held_samples(episodes)
    walked = []
    for episode in episodes:
        dy = episode.deviations()[1] / Y_SCALE
        base = (episode.y_base / Y_SCALE)[..., list(_COMMANDED)]
        angle = phase_angles(meta, episode.first_tick, episode.samples)
        starts = _draws(episode, hold)
        walked.append(Walked(wrenches(episode, meta), dy, base, angle, starts))
    return tuple(walked), hold


def past_rows(walk: Walked, at: NDArray[np.int64], length: int) -> Array:
    """[w; y] of the `length` samples before each of the samples `at`, oldest first.

    Shape (len(at), n, length · 12): per robot all wrenches, then all outputs.
    """
    places = at[:, None] + np.arange(-length, 0)
    parts = [
        np.swapaxes(x[places], 1, 2).reshape(len(at), x.shape[1], -1) for x in (walk.w, walk.y)
    ]
    return np.concatenate(parts, axis=2)


def modulated(x: Array, angle: Array, order: int) -> Array:
    """Every column of `x`, (M, c), times every harmonic. Shape (M, (2 order + 1) c)."""
    waves = harmonics(angle, order)
    return (waves[:, :, None] * x[:, None, :]).reshape(len(x), -1)


def forced(walk: Walked, at: NDArray[np.int64], degree: int) -> Array:
    """Wrenches of all robots at samples `at` times the polynomials there. (len(at), columns)."""
    w, values = walk.w[at].reshape(len(at), -1), polynomials(walk.angle[at], degree)
    return (values[:, :, None] * w[:, None, :]).reshape(len(at), -1)


def chunks(
    walks: Sequence[Walked], first: int, ahead: int, size: int, *, starts: bool
) -> Iterator[tuple[Walked, NDArray[np.int64]]]:
    """Samples with `first` samples before them and `ahead` from them on, at most `size` at a time.

    Args:
        walks: episodes.
        first: samples needed before.
        ahead: samples needed from the sample on.
        size: most samples in one piece.
        starts: only samples with which a new draw of the noise begins.
    """
    for walk in walks:
        at = np.arange(first, len(walk.w) - ahead + 1)
        if starts:
            at = walk.starts[(walk.starts >= first) & (walk.starts <= len(walk.w) - ahead)]
        for begin in range(0, len(at), size):
            yield walk, at[begin : begin + size]


def columns_of(n: int, degree: int) -> int:
    """Number of columns of `forced`."""
    return 2 * (degree + 1) * n * N_WRENCH


def outputs_of(walk: Walked, at: NDArray[np.int64]) -> Array:
    """Outputs of all robots at samples `at`. Shape (len(at), 6 n)."""
    y: Array = walk.y[at].reshape(len(at), walk.y.shape[1] * N_OUTPUTS)
    return y


def _changes(episode: Episode) -> NDArray[np.int64]:
    """Samples whose force deviations are not those of the sample before."""
    du = episode.deviations()[0].reshape(episode.samples, -1)
    changes: NDArray[np.int64] = 1 + np.flatnonzero(np.abs(np.diff(du, axis=0)).max(axis=1) > _SAME)
    return changes


def _held_samples(episodes: Sequence[Episode]) -> int:
    """For how many samples the forces are held, everywhere in the data: 1 or more."""
    held = 0
    for episode in episodes:
        held = int(np.gcd.reduce(np.append(np.diff(_changes(episode)), held)))
    return max(1, held)


def _draws(episode: Episode, hold: int) -> NDArray[np.int64]:
    """Samples with which a draw of the noise begins; none in an episode without noise."""
    changes = _changes(episode)
    if not len(changes):
        return changes
    return np.arange(int(changes[0]) % hold, episode.samples, hold)
