"""Periodic predictors: G as a function of the phase in a period, such as that of a gait.

No input acts backwards, and inputs act through fewer numbers w = B u, such as the net wrench of
four feet. The fit takes three steps, all on scaled signals: responses to w by local projections
(`estimate_response`), which of them are real (`shrink`), and what follows from the past under
nominal inputs (`fit_free`).
"""

from __future__ import annotations

import operator
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import groupby, product
from typing import Final, NamedTuple

import numpy as np
from numpy.polynomial import legendre
from scipy import linalg

from quadriga.agents.predictor.episode import Episode, Layout, check_episodes
from quadriga.agents.predictor.regression import Index, factorise
from quadriga.shared.errors import PredictorError
from quadriga.shared.robots.conventions import Array

FACTORS: Final = ("response", "free", "wrench")  # arrays of a periodic predictor
DEGREE: Final = 3  # of the polynomials of the phase in a response
FREE_ORDER: Final = 1  # harmonics of the map from the past
FOLDS: Final = 10
_ROWS: Final = 2048  # rows held in memory at a time; of draws, which are shorter, twice as many
_LEAST_FOLDS: Final = 3
_ROUNDING: Final = 1e-6  # rad: an angle this much before a half begins is meant to be its begin
_SAME: Final = 1e-9  # inputs of an agent that differ by less are held

# Of the responses.
_PAST: Final = 6  # samples before a pulse that explain what would have happened without it
_MEAN_ORDER: Final = 5  # harmonics of the mean walk
_COMMANDS: Final = 5  # places of the horizon at which the commanded outputs are looked at
_RIDGE: Final = 1e-3  # per row, of all regressors
_SMOOTH: Final = 0.01  # weight of a bend over the lags against the response itself
_SIGNIFICANT: Final = 3.0  # standard errors
_SMALLEST: Final = 0.08  # of the own response: a smaller one of a peer is left out

# Of what follows from the past.
_HELD_OUT: Final = 2  # folds, to choose the penalties by
_WORTH: Final = 0.98  # of the error without peers: what that with them must be below
# Candidate penalties per row: on everything, times this on harmonics, times this on peers, beside
# those without peers.
_RIDGES: Final = (1e-3, 1e-2, 1e-1)
_ON_HARMONICS: Final = (1.0, 10.0)
_ON_PEERS: Final = (1.0, 30.0)


@dataclass(frozen=True, slots=True)
class Period:
    """After how long a plant repeats itself, in ticks.

    Attributes:
        ticks: of a period.
        begin: a tick at which a period begins.
        sample: ticks of a sample.
    """

    ticks: int
    begin: int = 0
    sample: int = 1

    def angles(self, first_tick: int, count: int) -> Array:
        """Phases at the starts of samples, the first of which ends at `first_tick`, as angles.

        Shape (count,), rad.
        """
        starts = first_tick + self.sample * (np.arange(count) - 1) - self.begin
        angles: Array = 2.0 * np.pi * (starts % self.ticks) / self.ticks
        return angles

    @property
    def angle_step(self) -> float:
        """δ, what the phase advances in a sample, rad."""
        return float(np.diff(self.angles(0, 2))[0] % (2.0 * np.pi))


# ---- functions of the phase


def harmonics(angle: Array, order: int) -> Array:
    """1, √2 cos θ, √2 sin θ, …, √2 cos kθ, √2 sin kθ up to k = `order`: orthonormal over a period.

    Shape (*angle.shape, 2 order + 1).
    """
    k, shape = np.arange(1, order + 1) * angle[..., None], angle.shape
    waves = np.sqrt(2.0) * np.stack([np.cos(k), np.sin(k)], axis=-1)
    return np.concatenate([np.ones((*shape, 1)), waves.reshape(*shape, 2 * order)], axis=-1)


def polynomials(angle: Array, degree: int) -> Array:
    """Legendre polynomials in each half of the period, orthonormal over the period.

    Other feet stand in the other half: what a force does jumps from one half to the other.

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


def _shift_polynomials(degree: int, angle: float) -> Array:
    """M with polynomials(θ + angle) = polynomials(θ) M wherever both lie in the same half."""
    inside = np.linspace(0.1, np.pi - angle - 0.1, 4 * (degree + 1))
    theta = np.concatenate([inside, np.pi + inside])
    now, later = polynomials(theta, degree), polynomials(theta + angle, degree)
    M: Array = np.linalg.lstsq(now, later)[0].astype(np.float64)
    return M


# ---- the predictor


@dataclass(frozen=True, slots=True)
class PeriodicFactors:
    """What a periodic G is made of, in physical units but for the scale of w.

    Block (t, s) of G_ij at phase θ, which maps the inputs of sample s to the outputs of sample t,
    is h_{t−s}(θ + s δ) B for t ≥ s and zero before: no input acts backwards.

    Attributes:
        response: coefficients of h, what a w of a sample does l samples later, as polynomials of
            the phase, (2d + 2, N, n pushing, w, n responding, p).
        free: harmonics of the map from [w_ini; y_ini] to the outputs of the horizon,
            (2q + 1, n responding, n, p N, (w + p) T_ini).
        wrench: B, from the inputs to what they act by, of robots from the forces of four feet to
            their net wrench, (w, m).
    """

    response: Array
    free: Array
    wrench: Array

    def block(self, i: int, j: int, phase: int, phases: int) -> Array:
        """G_ij of one of `phases` equal parts of the period. Shape (p N, (m + p) T_ini + m N)."""
        free, components = self.free[:, i, j], len(self.wrench)
        T_ini = free.shape[2] // (components + self.response.shape[5])
        angle = np.array(2.0 * np.pi * phase / phases)
        past = np.tensordot(harmonics(angle, len(free) // 2), free, axes=1)
        on_w = past[:, : components * T_ini].reshape(-1, T_ini, components) @ self.wrench
        parts = on_w.reshape(len(past), -1), past[:, components * T_ini :]
        return np.concatenate([*parts, self.future_block(i, j, phase, phases)], axis=1)

    def future_block(self, i: int, j: int, phase: int, phases: int) -> Array:
        """The columns of G_ij that multiply the future inputs. Shape (p N, m N)."""
        response = self.response[:, :, j, :, i]
        _, N, _, outputs = response.shape
        angle = 2.0 * np.pi * (phase + np.arange(N)) / phases
        h = np.tensordot(polynomials(angle, len(response) // 2 - 1), response, axes=1)
        by_input = np.einsum("slwo,wu->slou", h, self.wrench)
        block = np.zeros((N, outputs, N, self.wrench.shape[1]))
        for s in range(N):
            block[s:, :, s] = by_input[s, : N - s]
        return block.reshape(N * outputs, -1)


def fit_periodic(
    episodes: Sequence[Episode],
    layout: Layout,
    period: Period,
    wrench: Array,
    response: Array | None = None,
) -> PeriodicFactors:
    """What G is made of: the responses, and by them what follows from the past.

    Args:
        episodes: of the plant, with inputs that are random and independent of the outputs, each
            draw held equally long.
        layout: of the predictor.
        period: after which the plant repeats itself.
        wrench: B, from an agent's inputs to what they act by, of order one, (w, m).
        response: coefficients of h, scaled, (k, N, n, w, n, p); None: estimated.

    Raises:
        PredictorError: too little data, or a singular problem.
    """
    check_episodes(episodes, layout)
    # For how many samples the inputs are held, everywhere in the data.
    changes = [np.diff(_changes(episode.deviations()[0])) for episode in episodes]
    hold = max(1, int(np.gcd.reduce(np.concatenate(changes))))
    walks = [_see(episode, layout, period, wrench, hold) for episode in episodes]
    h = estimate_response(walks, hold, layout, period.angle_step) if response is None else response
    free = fit_free(walks, h, layout)
    y_scale = np.array(layout.y_scale)
    # w keeps its scale.
    columns = np.concatenate([np.ones(len(wrench) * layout.T_ini), np.tile(y_scale, layout.T_ini)])
    physical = free * np.tile(y_scale, layout.N)[:, None] / columns
    return PeriodicFactors(h * y_scale, physical, wrench)


# ---- data


class _Walk(NamedTuple):
    """One episode as the regressions see it, scaled."""

    w: Array  # what the inputs act by, a team's net wrenches, (T, n, w)
    y: Array  # outputs, (T, n, p)
    base: Array  # commanded outputs, (T, n, c)
    angle: Array  # of the phase in the period at the sample's start, (T,), rad
    starts: Index  # samples with which a new draw of the inputs' noise begins; none without noise


def _see(episode: Episode, layout: Layout, period: Period, wrench: Array, hold: int) -> _Walk:
    du, dy = episode.deviations()
    y_scale, changes = np.array(layout.y_scale), _changes(du)
    starts = np.arange(int(changes[0]) % hold, len(du), hold) if len(changes) else changes
    base = (episode.y_base / y_scale)[..., list(layout.commanded)]
    angle = period.angles(episode.first_tick, len(du))
    return _Walk(du @ wrench.T, dy / y_scale, base, angle, starts)


def _changes(u: Array) -> Index:
    """Samples whose inputs are not those of the sample before."""
    steps = np.abs(np.diff(u.reshape(len(u), -1), axis=0)).max(axis=1)
    changes: Index = 1 + np.flatnonzero(steps > _SAME)
    return changes


def _past_rows(walk: _Walk, at: Index, length: int) -> Array:
    """[w; y] of the `length` samples before each of the samples `at`, oldest first.

    Shape (len(at), n · length · (w + p)): per agent all w, then all outputs.
    """
    places, n = at[:, None] + np.arange(-length, 0), walk.w.shape[1]
    parts = [np.swapaxes(x[places], 1, 2).reshape(len(at), n, -1) for x in (walk.w, walk.y)]
    return np.concatenate(parts, axis=2).reshape(len(at), -1)


def _forced(walk: _Walk, at: Index, degree: int) -> Array:
    """W of all agents at samples `at` times the polynomials there. (len(at), columns)."""
    w, values = walk.w[at].reshape(len(at), -1), polynomials(walk.angle[at], degree)
    return (values[:, :, None] * w[:, None, :]).reshape(len(at), -1)


class _Rows(NamedTuple):
    """Samples of a walk that are rows of a regression, few enough to be held in memory at once."""

    walk: _Walk
    at: Index
    fold: int  # which of `FOLDS` parts of all walks, one after the other in time, they begin in


def _rows(walks: Sequence[_Walk], first: int, ahead: int, *, starts: bool) -> list[_Rows]:
    """Samples with `first` samples before them and `ahead` from them on.

    With `starts` only those with which a new draw of the noise begins, each fold by itself.
    """
    usable = []
    for walk in walks:
        at = walk.starts if starts else np.arange(len(walk.w))
        usable.append(at[(at >= first) & (at <= len(walk.w) - ahead)])
    total, seen, rows = sum(map(len, usable)), 0, list[_Rows]()
    size = max(1, min(2 * _ROWS, -(-total // FOLDS))) if starts else _ROWS
    for walk, at in zip(walks, usable, strict=True):
        for begin in range(0, len(at), size):
            rows.append(_Rows(walk, at[begin : begin + size], seen * FOLDS // total))
            seen += len(rows[-1].at)
    return rows


class _Sums(NamedTuple):
    """Sums over rows of a regression with K regressors z; the third is one of the fit at hand.

    Of responses it is Σ z (later draw)ᵀ for each later draw, (draws, K, kw) with kw regressors of
    the pulse; of the map from the past Σ y² over all lags, (n, p).
    """

    zz: Array  # Σ z zᵀ, (K, K)
    zy: Array  # Σ z yᵀ for each lag: of responses (N, K, p n), else (K, N, n, p)
    third: Array
    rows: int


def _total(parts: Sequence[_Sums]) -> _Sums:
    return _Sums(*(reduce(operator.add, each) for each in zip(*parts, strict=True)))


# ---- responses: one regression for each lag
#
# For every sample t with which a new draw w_t of the noise begins, and every lag l,
#
#     y_{t+l} − Σ_s g_{l−s}(θ_{t+s}) w_{t+s} = g_l(θ_t) w_t + c_l z_t + e,   s = S, 2S, … ≤ l,
#
# with the later draws' responses subtracted as they are known from smaller lags. z_t holds what
# came before t; draws are independent of it, so that it only lowers the variance of g. All lags
# have the same regressors: one factorisation.


def estimate_response(
    walks: Sequence[_Walk], hold: int, layout: Layout, angle_step: float
) -> Array:
    """Coefficients of the response to a sample's w, scaled. (k, N, n, w, n, p).

    Raises:
        PredictorError: too little data.
    """
    n, rows = layout.agents, _rows(walks, _PAST, layout.N, starts=True)
    by_fold = groupby(rows, key=lambda part: part.fold)
    folds = [
        _total([_sum_response_rows(part.walk, part.at, layout.N, hold) for part in parts])
        for _, parts in by_fold
    ]
    if len(folds) < _LEAST_FOLDS:
        raise PredictorError(
            "data for the periodic predictor",
            f"{sum(len(part.at) for part in rows)} draws of the inputs' noise",
            "enough to be divided",
            "collect more: identification.seconds",
        )
    total = _total(folds)
    without = [_solve_lags(_Sums(*map(operator.sub, total, fold)), n, hold) for fold in folds]
    response = shrink(_solve_lags(total, n, hold), np.stack(without))
    for i, members in enumerate(layout.members):
        response[:, :, [j for j in range(n) if j not in members], :, i] = 0.0
    return spread_over_samples(response, hold, angle_step)


def _sum_response_rows(walk: _Walk, at: Index, N: int, hold: int) -> _Sums:
    pulse = _forced(walk, at, DEGREE)
    ahead = at[:, None] + np.linspace(0, N, _COMMANDS + 1).astype(int)[1:] - 1
    commands = walk.base[ahead] - walk.base[at - 1][:, None]
    past, mean = _past_rows(walk, at, _PAST), harmonics(walk.angle[at], _MEAN_ORDER)
    z = np.concatenate([past, mean, commands[:, :, 0].reshape(len(at), -1), pulse], axis=1)
    later = [_forced(walk, at + s, DEGREE) for s in range(hold, N, hold)]
    kw = pulse.shape[1]
    zw = np.stack([z.T @ w for w in later]) if later else np.zeros((0, z.shape[1], kw))
    zy = np.stack([z.T @ walk.y[at + lag].reshape(len(at), -1) for lag in range(N)])
    return _Sums(z.T @ z, zy, zw, len(at))


def _solve_lags(sums: _Sums, n: int, hold: int) -> Array:
    """Coefficients of the responses g to a held draw. Shape (2 DEGREE + 2, N, n, w, n, p)."""
    N, K, outputs = sums.zy.shape
    kw = sums.third.shape[2]
    penalised = sums.zz.copy(order="F")
    penalised.flat[:: K + 1] += _RIDGE * sums.rows
    factor = factorise(penalised)
    g = np.zeros((N, kw, outputs))
    for lag in range(N):
        rest = sums.zy[lag].copy()
        for draw in range(lag // hold):
            rest -= sums.third[draw] @ g[lag - hold * (draw + 1)]
        g[lag] = linalg.cho_solve((factor, True), rest, check_finite=False)[K - kw :]
    return g.reshape(N, 2 * DEGREE + 2, n, -1, n, outputs // n).swapaxes(0, 1)


def spread_over_samples(g: Array, hold: int, angle_step: float) -> Array:
    """Responses h to single samples that add up to the responses g to S samples in a row.

    g_l(θ) = Σ_m h_{l−m}(θ + m δ), m = 0 … S − 1: linear in the polynomials' coefficients. What it
    leaves open is chosen smooth in the lag. The coefficients of g are (2 DEGREE + 2, N, …), `hold`
    is S, `angle_step` δ, what the phase advances in a sample, rad.
    """
    if hold == 1:
        return g
    count, N = g.shape[:2]
    shift = _shift_polynomials(count // 2 - 1, angle_step)
    add = np.eye(count * N)
    for m in range(1, hold):
        add += np.kron(np.linalg.matrix_power(shift, m), np.eye(N, k=-m))
    bend = np.kron(np.eye(count), np.diff(np.eye(N), n=2, axis=0)[1:])  # the first lag may jump
    normal = add.T @ add + _SMOOTH * bend.T @ bend
    h = linalg.solve(normal, add.T @ g.reshape(count * N, -1), assume_a="pos")
    spread: Array = h.reshape(g.shape)
    return spread


# ---- which responses of peers are real
#
# Every fold of the data gives an estimate of its own (by the jackknife). Products of the estimates
# of two folds have the square of the true response as their mean, whatever the noise; how far the
# folds scatter tells how much of a response's square is noise.


def shrink(estimate: Array, without: Array) -> Array:
    """Draw groups of a response towards zero by what of them is noise.

    A group is one polynomial of the phase, at all lags, of one output's response to one component
    of one agent's w. With v the variance of its estimate x̂, it is multiplied by
    max(0, 1 − v/|x̂|²) (James and Stein). A peer's effect on an output as a whole is left out if it
    is not significant, or small against the agent's own.

    `estimate` is from all data, (k, N, n pushing, w, n responding, p), like the response, `without`
    from all folds but one, (F, k, N, n, w, n, p).
    """
    F, n = len(without), estimate.shape[2]
    deviation = without - without.mean(axis=0)
    variance = (F - 1) / F * (deviation**2).sum(axis=0)
    square, noise = (x.sum(axis=1, keepdims=True) for x in (estimate**2, variance))
    tiny = np.finfo(float).tiny
    response: Array = estimate * np.clip(1.0 - noise / np.maximum(square, tiny), 0.0, 1.0)
    # Each fold's own estimate over its error, (F, pushing, responding, output, all else).
    folds = (F * estimate - (F - 1) * without) * (1.0 / np.sqrt(np.maximum(noise, tiny)))
    flat = np.moveaxis(folds, (3, 5, 6), (1, 2, 3)).reshape(F, n, n, folds.shape[-1], -1)
    first, second = np.triu_indices(F, 1)
    pairs = (flat[first] * flat[second]).sum(axis=-1)
    error = np.sqrt((pairs**2).mean(axis=0) / len(pairs))
    size = np.einsum("kljwio,kljwio->jio", response, response)
    own = np.einsum("iio->io", size)
    kept = (pairs.mean(axis=0) > _SIGNIFICANT * error) & (size > _SMALLEST**2 * own)
    kept[range(n), range(n)] = True
    response *= kept[None, None, :, None]
    return response


# ---- what follows from the past
#
# What the inputs of the horizon do is subtracted first. The penalties are chosen for each output by
# the error on the last part of the data, from a fit to the rest.


def fit_free(walks: Sequence[_Walk], h: Array, layout: Layout) -> Array:
    """The map as harmonics. Shape (2 FREE_ORDER + 1, n responding, n, p N, (w + p) T_ini)."""
    train, rest = list[_Sums](), list[_Sums]()
    for walk, at, fold in _rows(walks, layout.T_ini, layout.N, starts=False):
        part = rest if fold >= FOLDS - _HELD_OUT else train
        part.append(_sum_free_rows(walk, at, h, layout.T_ini))
    sums = [_total(part) for part in (train, rest) if part]
    waves, (_, N, n, w, _, p) = 2 * FREE_ORDER + 1, h.shape
    width = (w + p) * layout.T_ini
    wave, agent, _ = np.indices((waves, n, width)).reshape(3, -1)
    x = np.zeros((n, p, waves * n * width, N))
    for i, members in enumerate(layout.members):
        own, every = np.flatnonzero(agent == i), np.flatnonzero(np.isin(agent, members))
        choices = [(own, 1.0), *((every, on_peers) for on_peers in _ON_PEERS if len(members) > 1)]
        candidates = []
        for (columns, on_peers), ridge, on_harmonics in product(choices, _RIDGES, _ON_HARMONICS):
            scale = np.where(agent[columns] == i, 1.0, on_peers)
            penalty = ridge * np.where(wave[columns] > 0, on_harmonics, 1.0) * scale
            candidates.append((columns, penalty))
        best = np.zeros(p, dtype=np.int64)
        if len(sums) == 2:
            best = _choose_penalties(sums[0], sums[1], i, candidates)
        for k in np.unique(best).tolist():
            solution, chosen = _solve_free(_total(sums), i, *candidates[k]), best == k
            x[i][np.ix_(chosen, candidates[k][0])] = solution[:, :, chosen].transpose(2, 0, 1)
    blocks = x.reshape(n, p, waves, n, width, N).transpose(2, 0, 3, 5, 1, 4)
    return blocks.reshape(waves, n, n, N * p, width)


def _sum_free_rows(walk: _Walk, at: Index, h: Array, T_ini: int) -> _Sums:
    _, N, n, _, _, p = h.shape
    past, waves = _past_rows(walk, at, T_ini), harmonics(walk.angle[at], FREE_ORDER)
    z = (waves[:, :, None] * past[:, None, :]).reshape(len(at), -1)
    y = np.stack([walk.y[at + lag].reshape(len(at), -1) for lag in range(N)], axis=1)
    y = (y - _forced_outputs(walk, at, h)).reshape(len(at), -1)
    yy = (y**2).sum(axis=0).reshape(N, n, p).sum(axis=0)
    return _Sums(z.T @ z, (z.T @ y).reshape(z.shape[1], N, n, p), yy, len(at))


def _forced_outputs(walk: _Walk, at: Index, h: Array) -> Array:
    """What w from samples `at` on does to the outputs there. Shape (len(at), N, p n)."""
    count, N, n, components, _, p = h.shape
    rows = h.transpose(1, 0, 2, 3, 4, 5).reshape(N, count * n * components, n * p)
    y = np.zeros((len(at), N, n * p))
    for s in range(N):
        w = _forced(walk, at + s, count // 2 - 1)
        later = rows[: N - s].transpose(1, 0, 2).reshape(w.shape[1], -1)
        y[:, s:] += (w @ later).reshape(len(at), N - s, -1)
    return y


def _choose_penalties(
    train: _Sums, rest: _Sums, i: int, candidates: Sequence[tuple[Index, Array]]
) -> Index:
    """The best candidate for each of agent `i`'s outputs.

    Peers count only where they lower the error by more than chance does.
    """
    errors = []
    for columns, penalty in candidates:
        x = _solve_free(train, i, columns, penalty)
        zz, zy = rest.zz[np.ix_(columns, columns)], rest.zy[columns, :, i]
        squares = (np.tensordot(zz, x, axes=1) - 2.0 * zy) * x
        errors.append(rest.third[i] + squares.sum(axis=(0, 1)))
    table, alone = np.array(errors), len(_RIDGES) * len(_ON_HARMONICS)
    table[alone:] /= _WORTH**2
    best: Index = np.argmin(table, axis=0)
    return best


def _solve_free(sums: _Sums, i: int, columns: Index, penalty: Array) -> Array:
    """Solution for the outputs of agent `i`. Shape (len(columns), N, p)."""
    A, b = sums.zz[np.ix_(columns, columns)].copy(order="F"), sums.zy[columns, :, i]
    A.flat[:: len(A) + 1] += penalty * sums.rows
    factor = factorise(A), True
    x: Array = linalg.cho_solve(factor, b.reshape(len(columns), -1), check_finite=False)
    return x.reshape(b.shape)
