"""Normal equations of the regression that every fit of G solves, from sliding Gram matrices."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.predictor.cyclic import cyclic_grams
from quadriga.agents.predictor.episode import U_SCALE, Y_SCALE, Episode
from quadriga.agents.predictor.hankel import columns, gram
from quadriga.agents.predictor.predictor import PredictorMeta
from quadriga.agents.time_grid import gait_phase
from quadriga.shared.errors import PredictorError
from quadriga.shared.robot.conventions import N_FORCES, N_OUTPUTS, Array
from quadriga.shared.wire.topics import SAMPLE_MS

Index = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Regression:
    """Sums over M windows of scaled deviations, z = [z^1; …; z^n], z^j = [u_ini^j; y_ini^j; u^j].

    Attributes:
        zz: Σ z zᵀ, shape (n W, n W) with W = 18 T_ini + 12 N.
        zy: Σ z y^iᵀ for every robot i, shape (n W, n, 6 N).
        windows: M.
    """

    zz: Array
    zy: Array
    windows: int


def normal_equations(episodes: Sequence[Episode], meta: PredictorMeta) -> Regression:
    """The regression over all windows of all episodes.

    Raises:
        PredictorError: no data, too little, or of another team.
    """
    check_episodes(episodes, meta)
    L = meta.T_ini + meta.N
    samples = [np.concatenate(episode.scaled_deviations(), axis=1) for episode in episodes]
    return _split_by_robot(gram(samples, L), meta, columns(samples, L))


def normal_equations_by_phase(
    episodes: Sequence[Episode], meta: PredictorMeta
) -> Iterator[Regression]:
    """The regression over the windows of each phase of the gait in turn.

    A window's phase is that of the end of its [u_ini; y_ini], where a plan would begin.

    Raises:
        PredictorError: no data, too little, or of another team.
    """
    check_episodes(episodes, meta)
    L = meta.T_ini + meta.N
    period = np.lcm(2 * meta.stance_ms, SAMPLE_MS) // SAMPLE_MS
    starts = np.array([e.first_tick + SAMPLE_MS * (meta.T_ini - 1) for e in episodes])
    origin = int(starts[0])
    if ((starts - origin) % SAMPLE_MS).any():
        raise PredictorError(
            "episodes: first_tick",
            f"{sorted({int(s) % SAMPLE_MS for s in starts})} modulo 10 ms",
            "samples on one grid",
        )
    part_of = np.array(
        [
            gait_phase(origin + SAMPLE_MS * k, meta.stand_ms, meta.stance_ms, meta.phases)
            for k in range(period)
        ]
    )
    places = ((starts - origin) // SAMPLE_MS) % period
    samples = [np.concatenate(episode.scaled_deviations(), axis=1) for episode in episodes]
    for windows, S in cyclic_grams(samples, places.tolist(), L, part_of):
        yield _split_by_robot(S, meta, windows)


def check_episodes(episodes: Sequence[Episode], meta: PredictorMeta) -> None:
    """Refuse data that no fit for `meta` can use.

    Raises:
        PredictorError: no data, too little, or of another team.
    """
    if not episodes:
        raise PredictorError("episodes", "none", "at least one", "did every walk end in a fall?")
    for episode in episodes:
        if episode.robots != meta.robots:
            raise PredictorError(
                "episode", f"{episode.robots} robots", f"{meta.robots}", "data of another team"
            )
        if episode.samples < meta.T_ini + meta.N:
            raise PredictorError(
                "episode",
                f"{episode.samples} samples",
                f"at least {meta.T_ini + meta.N}",
                "cut short by a fall",
            )


def to_physical(x: Array, meta: PredictorMeta) -> Array:
    """Blocks in physical units, (n, n, 6 N, W), from scaled solutions (n, n W, 6 N)."""
    n = meta.robots
    blocks = x.reshape(n, n, meta.width, -1).transpose(0, 1, 3, 2)
    z_scale, y_scale = scales(meta)
    return np.ascontiguousarray(blocks * y_scale[:, None] / z_scale)


def scaled_blocks(G: Array, meta: PredictorMeta) -> Array:
    """Blocks that map scaled deviations to scaled deviations, of the shape of `G`."""
    z_scale, y_scale = scales(meta)
    return G * z_scale / y_scale[:, None]


def scales(meta: PredictorMeta) -> tuple[Array, Array]:
    """Scales of one robot's [u_ini; y_ini; u], shape (W,), and y, shape (6 N,)."""
    z_scale = np.concatenate(
        [
            np.full(N_FORCES * meta.T_ini, U_SCALE),
            np.tile(Y_SCALE, meta.T_ini),
            np.full(N_FORCES * meta.N, U_SCALE),
        ]
    )
    return z_scale, np.tile(Y_SCALE, meta.N)


def past_first(meta: PredictorMeta, members: Sequence[int]) -> Index:
    """Rows of `zz` of some robots by time: all [u_ini; y_ini], then each sample's forces."""
    rows = np.arange(meta.robots * meta.width).reshape(meta.robots, -1)[list(members)]
    future = rows[:, meta.past :].reshape(len(members), meta.N, N_FORCES)
    return np.concatenate([rows[:, : meta.past].ravel(), future.transpose(1, 0, 2).ravel()])


def robots_first(index: Index, n: int, dim: int) -> Index:
    """Reorder stacked (time, robot, dim) indices to one row of (time, dim) per robot."""
    return index.reshape(-1, n, dim).transpose(1, 0, 2).reshape(n, -1)


def _split_by_robot(S: Array, meta: PredictorMeta, windows: int) -> Regression:
    """Cut the Gram matrix of windows of [u of all; y of all] into the robots' parts."""
    n, m, p = meta.robots, N_FORCES, N_OUTPUTS
    index = np.arange((meta.T_ini + meta.N) * n * (m + p)).reshape(-1, n * (m + p))
    past, future = index[: meta.T_ini], index[meta.T_ini :]
    parts = ((past[:, : n * m], m), (past[:, n * m :], p), (future[:, : n * m], m))
    inputs = np.concatenate([robots_first(part, n, dim) for part, dim in parts], axis=1).ravel()
    outputs = robots_first(future[:, n * m :], n, p).ravel()
    return Regression(
        S[np.ix_(inputs, inputs)], S[np.ix_(inputs, outputs)].reshape(len(inputs), n, -1), windows
    )
