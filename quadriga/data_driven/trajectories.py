"""Measured inputs and outputs of a plant, from which all else is made."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from quadriga.agents.predictor.hankel import columns
from quadriga.agents.predictor.layout import Layout, everyone
from quadriga.data_driven.signals import as_count, as_numbers, root_mean_squares
from quadriga.shared.errors import PredictorError
from quadriga.shared.robot.conventions import Array


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
        self.single = inputs[0].ndim == 2
        _check_shapes(inputs, outputs)
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
        past, horizon = as_count("past", past), as_count("horizon", horizon)
        self._check_variation()
        if not columns(self.u, past + horizon):
            raise PredictorError(
                "data",
                f"episodes of at most {max(len(u) for u in self.u)} samples",
                f"at least {past + horizon}, past and horizon",
                "too little data",
            )
        return Layout(
            self.agents,
            self.inputs,
            self.outputs,
            past,
            horizon,
            root_mean_squares(self.u),
            root_mean_squares(self.y),
            everyone(self.agents),
        )

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

    def scaled(self, layout: Layout) -> list[Array]:
        """Scaled signals of every episode, [u of all agents; y of all agents]."""
        scales = np.array(layout.u_scale), np.array(layout.y_scale)
        return [
            np.concatenate(
                [
                    (signal / scale).reshape(len(signal), -1)
                    for signal, scale in zip((u, y), scales, strict=True)
                ],
                axis=1,
            )
            for u, y in zip(self.u, self.y, strict=True)
        ]


def _episodes(name: str, signals: Sequence[ArrayLike] | Array) -> list[Array]:
    if isinstance(signals, np.ndarray):
        signals = [signals]
    if not len(signals):
        raise PredictorError(name, "no episode", "at least one")
    return [as_numbers(name, signal).copy() for signal in signals]


def _check_shapes(inputs: Sequence[Array], outputs: Sequence[Array]) -> None:
    """Refuse episodes that are not of one plant.

    Raises:
        PredictorError: it names the first shape that does not fit.
    """
    for name, signals in (("data.u", inputs), ("data.y", outputs)):
        expected = signals[0].shape[1:]
        for signal in signals:
            if signal.ndim not in (2, 3) or not signal.size or signal.shape[1:] != expected:
                raise PredictorError(
                    name,
                    f"shape {signal.shape}",
                    "(T, dim), or (T, n, dim) of n agents, alike in all episodes",
                    "samples come first",
                )
    for u, y in zip(inputs, outputs, strict=True):
        if u.shape[:-1] != y.shape[:-1]:
            raise PredictorError(
                "data",
                f"inputs of shape {u.shape} with outputs of shape {y.shape}",
                "as many samples and agents of both",
            )
