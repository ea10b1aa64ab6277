"""Rows of the periodic predictor's regressions on episodes of a plant with a period."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.predictor.episode import Y_SCALE, Episode
from quadriga.agents.predictor.periodic_basis import harmonics, phase_angles, polynomials, wrenches
from quadriga.agents.predictor.predictor import PredictorMeta
from quadriga.shared.robot.conventions import Array

_SAME: Final = 1e-9  # N of a robot: inputs that differ by less are held
_COMMANDED: Final = (1, 2, 5)  # vx, vy, wz: outputs whose base moves with the reference


class Walked(NamedTuple):
    """One episode as the regressions see it, scaled.

    Attributes:
        w: what the inputs act by, a team's net wrenches, (T, n, w).
        y: outputs, (T, n, p).
        base: commanded outputs, (T, n, c); a plant without commands has none, c = 0.
        angle: of the phase in the period at the sample's start, (T,), rad.
        starts: samples with which a new draw of the inputs' noise begins, in order.
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
    hold = held_samples([episode.deviations()[0] for episode in episodes])
    walked = []
    for episode in episodes:
        du, dy = episode.deviations()
        base = (episode.y_base / Y_SCALE)[..., list(_COMMANDED)]
        angle = phase_angles(meta, episode.first_tick, episode.samples)
        walked.append(
            Walked(wrenches(episode, meta), dy / Y_SCALE, base, angle, draw_starts(du, hold))
        )
    return tuple(walked), hold


def past_rows(walk: Walked, at: NDArray[np.int64], length: int) -> Array:
    """[w; y] of the `length` samples before each of the samples `at`, oldest first.

    Shape (len(at), n, length · (w + p)): per agent all wrenches, then all outputs.
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
    """Wrenches of all agents at samples `at` times the polynomials there. (len(at), columns)."""
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


def outputs_of(walk: Walked, at: NDArray[np.int64]) -> Array:
    """Outputs of all agents at samples `at`. Shape (len(at), p n)."""
    y: Array = walk.y[at].reshape(len(at), walk.y.shape[1] * walk.y.shape[2])
    return y


def held_samples(inputs: Sequence[Array]) -> int:
    """For how many samples the inputs are held, everywhere in the data: 1 or more.

    Args:
        inputs: of each episode, shape (T, n, m).
    """
    held = 0
    for u in inputs:
        held = int(np.gcd.reduce(np.append(np.diff(_changes(u)), held)))
    return max(1, held)


def draw_starts(u: Array, hold: int) -> NDArray[np.int64]:
    """Samples with which a draw of the noise begins; none in an episode without noise."""
    changes = _changes(u)
    if not len(changes):
        return changes
    return np.arange(int(changes[0]) % hold, len(u), hold)


def _changes(u: Array) -> NDArray[np.int64]:
    """Samples whose inputs are not those of the sample before."""
    flat = u.reshape(len(u), -1)
    changes: NDArray[np.int64] = 1 + np.flatnonzero(
        np.abs(np.diff(flat, axis=0)).max(axis=1) > _SAME
    )
    return changes
