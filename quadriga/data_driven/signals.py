"""Signals of a plant: their shapes are checked once, where a user hands them in."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from quadriga.shared.errors import PredictorError
from quadriga.shared.robot.conventions import Array

_MOST: Final = 1e100


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


def as_count(name: str, value: object) -> int:
    """A number of samples, at least 1.

    Raises:
        PredictorError: anything else.
    """
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 1:
        raise PredictorError(name, repr(value), "a whole number of samples, at least 1")
    return int(value)


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


def as_reference(name: str, values: ArrayLike, shape: tuple[int, ...], *, single: bool) -> Array:
    """A reference over the horizon, which may be one sample for all of it.

    Args:
        name: of the argument, for errors.
        values: of the shape of one sample, (dim,) or (n, dim), or of the whole horizon.
        shape: (N, n, dim) that is returned.
        single: whether the plant was given without an axis of agents.

    Raises:
        PredictorError: another shape, or numbers that are not finite.
    """
    array = as_numbers(name, values)
    one = shape[2:] if single else shape[1:]
    if array.shape == one:
        return np.broadcast_to(array.reshape(shape[1:]), shape)
    return as_signal(name, array, shape, single=single)


def stack(signal: Array) -> Array:
    """A signal (T, n, dim) as a vector: agent by agent, samples in the order of time."""
    return signal.transpose(1, 0, 2).ravel()


def unstack(vector: Array, agents: int, dim: int, *, single: bool) -> Array:
    """The signal of a vector of `stack`, (T, n, dim), or (T, dim) of a single agent."""
    signal = vector.reshape(agents, -1, dim).transpose(1, 0, 2)
    return signal[:, 0] if single else signal


def root_mean_squares(signals: tuple[Array, ...]) -> tuple[float, ...]:
    """Sizes of the components of signals (T, n, dim); 1 for a component that is always zero."""
    squares = np.concatenate([signal.reshape(-1, signal.shape[2]) for signal in signals]) ** 2
    sizes = np.sqrt(squares.mean(axis=0))
    return tuple(np.where(sizes > 0.0, sizes, 1.0).tolist())
