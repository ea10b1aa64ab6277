"""Predictors of any plant: what the robots use, for any numbers of inputs and outputs.

    data = Data(u=[u], y=[y])                       # inputs (T, m) and outputs (T, p) of episodes
    predictor = fit(data, kind="pinv", past=4, horizon=30)
    y = predictor.predict(past_u, past_y, future_u) # (N, p)

Equations have the numbers that they have everywhere in this project: the Hankel matrix is eq. 2,
the matrix G of subspace predictive control eq. 6. A plant may be of several agents, with inputs and
outputs of their own: then every signal has an axis more, (T, n, m). Every mistake is a
`quadriga.shared.errors.PredictorError` that names it. Plans: `quadriga.agents.predictor.control`.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from quadriga.agents.predictor.episode import Layout, everyone
from quadriga.agents.predictor.hankel import columns, windows
from quadriga.agents.predictor.periodic import (
    Walked,
    draw_starts,
    estimate_response,
    fit_factors,
    held_samples,
)
from quadriga.agents.predictor.regression import Penalty, excitation, fit_blocks
from quadriga.agents.predictor.store import name_damage, read_archive, write_archive
from quadriga.shared.errors import PredictorError, did_you_mean
from quadriga.shared.robots.conventions import Array

KINDS: Final = ("pinv", "ridge", "periodic")
_MOST: Final = 1e100


class Data:
    """Episodes of one plant, each without gaps; read-only.

    Row k of an input and row k of an output belong together: y_k may depend on u_k and on all
    that came before. Nothing is subtracted: for a plant that is linear about a working point, hand
    in deviations from it.

    Args:
        u: inputs of each episode, shape (T, m), or (T, n, m) of n agents; an array is one episode.
        y: outputs of each episode, shape (T, p), or (T, n, p).
        first: time index of each episode's first sample, which only a periodic plant depends on;
            zeros if left out.

    Attributes:
        u, y: of each episode, always with an axis of agents, (T, n, m) and (T, n, p).
        first: time index of each episode's first sample.
        single: whether the signals were given without an axis of agents.

    Raises:
        PredictorError: no data, shapes that do not belong together, NaN or infinity.
    """

    def __init__(
        self,
        u: Sequence[ArrayLike] | Array,
        y: Sequence[ArrayLike] | Array,
        first: Sequence[int] | None = None,
    ) -> None:
        inputs, outputs = _episodes("data.u", u), _episodes("data.y", y)
        if len(inputs) != len(outputs):
            raise PredictorError(
                "data", f"inputs of {len(inputs)} episodes", f"{len(outputs)}, as of the outputs"
            )
        for a, b in zip(inputs, outputs, strict=True):
            if a.shape[:-1] != b.shape[:-1]:
                raise PredictorError(
                    "data",
                    f"inputs of shape {a.shape} with outputs of shape {b.shape}",
                    "as many samples and agents of both",
                )
        self.single = inputs[0].ndim == 2
        self.u, self.y = (
            tuple(x[:, None] if self.single else x for x in xs) for xs in (inputs, outputs)
        )
        for signal in (*self.u, *self.y):
            signal.setflags(write=False)
        self.first = tuple(first) if first is not None else (0,) * len(inputs)
        if len(self.first) != len(inputs):
            raise PredictorError(
                "data.first", f"{len(self.first)} numbers", f"one of each of {len(inputs)} episodes"
            )

    @property
    def agents(self) -> int:
        """The number n of agents."""
        return int(self.u[0].shape[1])

    @property
    def inputs(self) -> int:
        """The number m of inputs of each agent."""
        return int(self.u[0].shape[2])

    @property
    def outputs(self) -> int:
        """The number p of outputs of each agent."""
        return int(self.y[0].shape[2])

    @property
    def samples(self) -> int:
        """Samples of all episodes together."""
        return sum(len(u) for u in self.u)

    def layout(self, past: int, horizon: int) -> Layout:
        """The layout of a predictor of this plant; its scales are the sizes of these signals.

        Raises:
            PredictorError: no whole numbers of samples, no episode that long, or an input that
                never changes.

        Warns:
            UserWarning: signals with a mean beyond their standard deviation.
        """
        for name, value in (("past", past), ("horizon", horizon)):
            if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 1:
                raise PredictorError(name, repr(value), "a whole number of samples, at least 1")
        self._check_variation()
        if not columns(self.u, past + horizon):
            raise PredictorError(
                "data",
                f"episodes of at most {max(len(u) for u in self.u)} samples",
                f"at least {past + horizon}, past and horizon",
                "too little data",
            )
        scales = _root_mean_squares(self.u), _root_mean_squares(self.y)
        sizes = self.agents, self.inputs, self.outputs, int(past), int(horizon)
        return Layout(*sizes, *scales, everyone(self.agents))

    def check_excitation(self, order: int) -> None:
        """Refuse inputs from which the plant's response cannot be told.

        Raises:
            PredictorError: the inputs are not persistently exciting of this order.
        """
        sizes = np.array(_root_mean_squares(self.u))
        found = excitation([(u / sizes).reshape(len(u), -1) for u in self.u], order)
        if not found.persistent:
            raise PredictorError(
                "data.u",
                f"inputs that are not persistently exciting of order {order}, past and horizon "
                f"(rank {found.rank} of {found.rows}, {found.columns} columns)",
                f"a Hankel matrix of rank {found.rows}",
                "too little data, or an input that hardly varies",
            )

    def scaled(self, layout: Layout) -> list[Array]:
        """Scaled signals of every episode, [u of all agents; y of all agents]."""
        u_scale, y_scale = np.array(layout.u_scale), np.array(layout.y_scale)
        return [
            np.concatenate([(x / s).reshape(len(x), -1) for x, s in ((u, u_scale), (y, y_scale))],
                           axis=1)
            for u, y in zip(self.u, self.y, strict=True)
        ]  # fmt: skip

    def _check_variation(self) -> None:
        """Refuse an input that never changes, and warn of a working point that is not zero.

        Raises:
            PredictorError: a constant input, of which no fit tells what it does.
        """
        for name, signals in (("u", self.u), ("y", self.y)):
            each = np.concatenate([x.reshape(len(x), -1) for x in signals])
            mean, spread = each.mean(axis=0), each.std(axis=0)
            still = spread <= 1e-12 * np.abs(each).max(axis=0)
            if name == "u" and still.any():
                which = np.flatnonzero(still).tolist()
                raise PredictorError(
                    f"data.{name}", f"columns {which} constant", "inputs that vary"
                )
            if (np.abs(mean) > spread)[~still].any():
                warnings.warn(
                    f"data.{name} has a mean beyond its standard deviation, and a fit has no "
                    "intercept: hand in deviations from the working point",
                    stacklevel=4,
                )


@dataclass(frozen=True, slots=True, eq=False)
class PlantPredictor:
    """y^i = Σ_j G_ij [u_ini^j; y_ini^j; u^j], in the units of the data (eq. 6, 9).

    Attributes:
        kind: name of the fit, see `fit`.
        layout: sizes, and the scales of the data that it was fitted to.
        blocks: G_ij, shape (P, n, n, p N, W) with W = (m + p) T_ini + m N, read-only, for each of
            P samples of a period; P = 1 unless it is periodic. Rows and columns are time-major.
        single: whether signals have no axis of agents.
        condition: number of the regression, penalty included; None: unknown.
    """

    kind: str
    layout: Layout
    blocks: Array
    single: bool
    condition: float | None = None

    def __post_init__(self) -> None:
        n = self.layout.agents
        expected = (n, n, self.layout.rows, self.layout.width)
        if self.blocks.shape[1:] != expected or not len(self.blocks):
            raise PredictorError(
                "predictor.blocks", f"shape {self.blocks.shape}", f"(P, …{expected})"
            )
        self.blocks.setflags(write=False)

    @property
    def period(self) -> int:
        """P, samples after which G repeats itself; 1 unless it is periodic."""
        return len(self.blocks)

    @property
    def G(self) -> Array:
        """The whole matrix of eq. 6, of a periodic plant that of phase 0; see `matrix`."""
        return self.matrix(0)

    def matrix(self, phase: int) -> Array:
        """G as one matrix, agents stacked. Shape (p N n, W n), columns [u_ini; y_ini; u] of each.

        Args:
            phase: time index of the horizon's first sample, modulo the period.
        """
        n, rows, W = self.layout.agents, self.layout.rows, self.layout.width
        blocks = self.blocks[phase % self.period]
        whole: Array = blocks.transpose(0, 2, 1, 3).reshape(n * rows, n * W)
        return whole

    def predict(
        self, past_u: ArrayLike, past_y: ArrayLike, future_u: ArrayLike, phase: int = 0
    ) -> Array:
        """Predicted outputs over the horizon.

        Args:
            past_u: the last T_ini inputs, oldest first, shape (T_ini, m), or (T_ini, n, m).
            past_y: the outputs that belong to them, shape (T_ini, p), or (T_ini, n, p).
            future_u: inputs of the horizon, shape (N, m), or (N, n, m).
            phase: time index of the horizon's first sample, of a periodic plant.

        Returns:
            Shape (N, p), or (N, n, p).

        Raises:
            PredictorError: another shape, or numbers that are not finite.
        """
        layout = self.layout
        n, m, p = layout.agents, layout.inputs, layout.outputs
        parts = [
            as_signal(name, signal, (samples, n, dim), single=self.single)
            for name, signal, samples, dim in (
                ("past_u", past_u, layout.T_ini, m),
                ("past_y", past_y, layout.T_ini, p),
                ("future_u", future_u, layout.N, m),
            )
        ]
        z = np.concatenate([part.transpose(1, 0, 2).reshape(n, -1) for part in parts], axis=1)
        return unstack(self.matrix(phase) @ z.ravel(), n, p, single=self.single)


def fit(
    data: Data,
    kind: str = "pinv",
    past: int = 4,
    horizon: int = 30,
    *,
    ridge: float = 1e-6,
    peer_weight: float = 1.0,
    period: int | None = None,
    input_map: ArrayLike | None = None,
) -> PlantPredictor:
    """Fit the matrix G that maps past and future inputs to future outputs (eq. 6).

    - `pinv`: subspace predictive control, the pseudo-inverse of eq. 6, of least norm;
    - `ridge`: least squares with a penalty, for less variance where data are noisy or few;
    - `periodic`: a G of its own for each sample of a period, in which no input acts backwards; its
      inputs must be random and independent of the outputs, each draw held equally long.

    Signals are scaled by their root mean square before they are fitted, so that a ridge means the
    same for every plant.

    Args:
        data: of the plant; episodes shorter than past + horizon are ignored.
        kind: one of `KINDS`.
        past: T_ini, samples that tell the plant's state: at least its lag.
        horizon: N, samples to predict.
        ridge: penalty per window on scaled columns, of `ridge`.
        peer_weight: of a plant of several agents: the penalty on what one does to another is this
            squared times as large.
        period: of `periodic`: samples after which the plant repeats itself; see `Data.first`.
        input_map: of `periodic`: what the inputs of an agent act by, shape (w, m), such as the net
            wrench of forces; the identity if left out.

    Raises:
        PredictorError: an unknown kind, too little data, or inputs that do not excite the plant.
    """
    if kind not in KINDS:
        raise PredictorError("kind", repr(kind), ", ".join(KINDS), did_you_mean(kind, KINDS))
    if (period is not None) != (kind == "periodic"):
        raise PredictorError(
            "period", f"{period} with kind {kind!r}", 'a period with "periodic", else none'
        )
    if not (ridge >= 0.0 and peer_weight > 0.0):
        raise PredictorError(
            "ridge, peer_weight", f"{ridge:g}, {peer_weight:g}", "not negative, and positive"
        )
    layout = data.layout(past, horizon)
    if period is not None:
        actions = np.eye(data.inputs) if input_map is None else input_map
        return PlantPredictor(
            kind, layout, _fit_periodic(data, layout, period, actions), data.single
        )
    if kind == "pinv" or ridge == 0.0:
        data.check_excitation(past + horizon)
    blocks, condition = fit_blocks(kind, data.scaled(layout), layout, Penalty(ridge, peer_weight))
    return PlantPredictor(kind, layout, blocks, data.single, condition)


def _fit_periodic(data: Data, layout: Layout, period: int, input_map: ArrayLike) -> Array:
    """Blocks of G for every sample of the period, (period, n, n, p N, W).

    Raises:
        PredictorError: no such period or map, or too little data.
    """
    actions = as_numbers("input_map", input_map)
    if actions.ndim != 2 or actions.shape[1] != layout.inputs:
        raise PredictorError("input_map", f"shape {actions.shape}", f"(w, {layout.inputs})")
    if period < 2:
        raise PredictorError("period", f"{period} samples", "at least 2")
    sizes = np.array(_root_mean_squares(tuple(u @ actions.T for u in data.u)))
    actions = actions / sizes[:, None]
    inputs = [u / np.array(layout.u_scale) for u in data.u]
    hold, step = held_samples(inputs), 2.0 * np.pi / period
    episodes = tuple(
        Walked(
            u @ actions.T,
            y / np.array(layout.y_scale),
            np.zeros((*u.shape[:2], 0)),
            2.0 * np.pi / period * ((first + np.arange(len(u), dtype=np.float64)) % period),
            draw_starts(scaled, hold),
        )
        for u, y, first, scaled in zip(data.u, data.y, data.first, inputs, strict=True)
    )
    h = estimate_response(episodes, hold, layout, step)
    factors = fit_factors(episodes, h, layout, actions)
    agents = range(layout.agents)
    return np.array(
        [[[factors.block(i, j, k, period) for j in agents] for i in agents] for k in range(period)]
    )


@dataclass(frozen=True, slots=True, eq=False)
class Judgement:
    """Errors over all windows, samples of the horizon and agents, in the units of the outputs.

    Attributes:
        windows: how many were predicted.
        rmse: root mean square of the error of each output, shape (p,).
        persistence: the same if every output kept its last measured value, shape (p,).
        ratio: of the two, outputs in their scales; below 1 the predictor is of use.
    """

    windows: int
    rmse: Array
    persistence: Array
    ratio: float


def judge(predictor: PlantPredictor, data: Data) -> Judgement:
    """Predict every window of data and compare.

    Args:
        predictor: of the plant.
        data: not those it was fitted to; episodes shorter than past + horizon are ignored.

    Raises:
        PredictorError: data of another plant, or too short.
    """
    layout = predictor.layout
    got = data.agents, data.inputs, data.outputs
    expected = layout.agents, layout.inputs, layout.outputs
    if got != expected:
        raise PredictorError("data", f"(agents, inputs, outputs) = {got}", f"{expected}")
    length = layout.T_ini + layout.N
    count, errors, naive = 0, np.zeros(layout.outputs), np.zeros(layout.outputs)
    for u, y, first in zip(data.u, data.y, data.first, strict=True):
        if len(u) < length:
            continue
        z, future = windows(u, y, layout.T_ini, layout.N)
        n, _, here = z.shape
        stacked, predicted = z.reshape(-1, here), np.empty((n * layout.rows, here))
        phases = (first + layout.T_ini + np.arange(here)) % predictor.period
        for phase in np.unique(phases):
            now = phases == phase
            predicted[:, now] = predictor.matrix(int(phase)) @ stacked[:, now]
        shape = (n, layout.N, layout.outputs, -1)
        future = future.reshape(shape)
        last = z[:, layout.inputs * layout.T_ini : layout.past].reshape(
            n, layout.T_ini, layout.outputs, -1
        )[:, -1:]
        errors += ((predicted.reshape(shape) - future) ** 2).sum(axis=(0, 1, 3))
        naive += ((future - last) ** 2).sum(axis=(0, 1, 3))
        count += here
    if not count:
        raise PredictorError(
            "data", "no episode that long", f"at least {length} samples", "too little data"
        )
    total = count * layout.N * layout.agents
    rmse, persistence = np.sqrt(errors / total), np.sqrt(naive / total)
    scale = np.array(layout.y_scale)
    naive_size = float(np.linalg.norm(persistence / scale))
    ratio = float(np.linalg.norm(rmse / scale)) / naive_size if naive_size > 0.0 else np.inf
    return Judgement(count, rmse, persistence, ratio)


def is_persistently_exciting(signal: ArrayLike | Sequence[ArrayLike], order: int) -> bool:
    """Whether the Hankel matrix of `order` of a signal has full row rank (definition 1).

    For the fundamental lemma (Willems et al.) the inputs must be so of the order past + horizon +
    states of the plant. Singular values below 1e-6 of the largest count as zero.

    Args:
        signal: shape (T, dim), or a list of episodes, which count together.
        order: number of block rows.

    Raises:
        PredictorError: another shape, NaN, or fewer samples than block rows.
    """
    given: list[Any] = [signal]
    if isinstance(signal, list | tuple) and signal and np.ndim(signal[0]) == 2:
        given = [*signal]
    signals = [as_numbers("signal", one) for one in given]
    if any(x.ndim != 2 or x.shape[1] != signals[0].shape[1] for x in signals):
        shapes = [x.shape for x in signals]
        raise PredictorError("signal", f"shapes {shapes}", "(T, dim), alike in all episodes")
    if order < 1 or not columns(signals, order):
        raise PredictorError(
            "signal",
            f"at most {max(len(x) for x in signals)} samples in a row",
            f"at least {order}, the number of block rows, which is positive",
            "too little data",
        )
    return excitation(signals, order).persistent


def save(path: Path | str, predictor: PlantPredictor) -> None:
    """Write a predictor to a file of NumPy's; a file half written never has the name `path`.

    Raises:
        PredictorFileError: the file cannot be written.
    """
    meta = {
        "plant": predictor.kind,
        "layout": asdict(predictor.layout),
        "single": predictor.single,
        "condition": predictor.condition,
    }
    write_archive(Path(path), meta, {"blocks": predictor.blocks}, {})


def load(path: Path | str) -> PlantPredictor:
    """Read a predictor of `save`.

    Raises:
        PredictorFileError: no such file, no predictor of `save`, or one that was damaged.
    """
    path = Path(path)
    meta, arrays, _ = read_archive(path)
    with name_damage(path):
        body = meta["layout"]
        for name in ("u_scale", "y_scale"):
            body[name] = tuple(body[name])
        body["members"] = tuple(tuple(agents) for agents in body["members"])
        layout, blocks = Layout(**body), np.ascontiguousarray(arrays["blocks"])
        return PlantPredictor(meta["plant"], layout, blocks, meta["single"], meta["condition"])


# ---- signals: their shapes are checked once, where a user hands them in


def as_numbers(name: str, values: ArrayLike) -> Array:
    """An array of finite numbers, whose squares and their sums are finite too.

    Raises:
        PredictorError: no real numbers, masked ones, NaN, infinity or numbers beyond 1e100.
    """
    if np.ma.is_masked(values):
        raise PredictorError(
            name, "masked samples", "numbers", "split the data into episodes there"
        )
    if np.iscomplexobj(values):
        raise PredictorError(name, "complex numbers", "real numbers")
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise PredictorError(name, "something else", "an array of numbers") from None
    if not np.isfinite(array).all():
        raise PredictorError(name, "NaN or infinity", "finite numbers", "samples that were lost?")
    if (np.abs(array) > _MOST).any():
        raise PredictorError(name, f"{np.abs(array).max():.3g}", f"numbers up to {_MOST:g}")
    return array


def as_signal(name: str, values: ArrayLike, shape: tuple[int, ...], *, single: bool) -> Array:
    """A signal with an axis of agents.

    Args:
        name: of the argument, for errors.
        values: of shape (T, dim) of a plant of a single agent, else (T, n, dim).
        shape: (T, n, dim) that is expected.
        single: whether the plant was given without an axis of agents.

    Raises:
        PredictorError: another shape, or numbers that are not finite.
    """
    expected = (shape[0], shape[2]) if single else shape
    array = as_numbers(name, values)
    if array.shape != expected:
        raise PredictorError(name, f"shape {array.shape}", f"{expected}", "samples come first")
    return array.reshape(shape)


def unstack(vector: Array, agents: int, dim: int, *, single: bool) -> Array:
    """The signal of a vector, agent by agent, (T, n, dim), or (T, dim) of a single agent."""
    signal = vector.reshape(agents, -1, dim).transpose(1, 0, 2)
    return signal[:, 0] if single else signal


def _episodes(name: str, signals: Sequence[ArrayLike] | Array) -> list[Array]:
    if isinstance(signals, np.ndarray):
        signals = [signals]
    if not len(signals):
        raise PredictorError(name, "no episode", "at least one")
    arrays = [as_numbers(name, signal).copy() for signal in signals]
    for array in arrays:
        alike = array.shape[1:] == arrays[0].shape[1:]
        if array.ndim not in (2, 3) or not array.size or not alike:
            raise PredictorError(
                name,
                f"shape {array.shape}",
                "(T, dim), or (T, n, dim) of n agents, alike in all episodes",
                "samples come first",
            )
    return arrays


def _root_mean_squares(signals: tuple[Array, ...]) -> tuple[float, ...]:
    """Sizes of the components of signals (T, n, dim); 1 for a component that is always zero."""
    squares = np.concatenate([signal.reshape(-1, signal.shape[2]) for signal in signals]) ** 2
    sizes = np.sqrt(squares.mean(axis=0))
    return tuple(np.where(sizes > 0.0, sizes, 1.0).tolist())
