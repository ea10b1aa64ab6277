"""Measured responses to pulses, in memory and in files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadriga.shared.errors import PredictorFileError
from quadriga.shared.robots.conventions import N_FORCES, N_OUTPUTS, Array
from quadriga.shared.runtime.atomic import atomic_write
from quadriga.shared.runtime.npz import UNREADABLE, as_measured, open_npz


@dataclass(frozen=True, slots=True)
class Repetition:
    """Responses to every pulse, measured in one world; NaN where a robot fell.

    Attributes:
        seed: of the world.
        ticks: at which the pulses begin, one for each of P phases of the gait, shape (P,), ms.
        u: force deviation that the pulse is, by phase, pulsed robot, direction and sample of the
            horizon, shape (P, n, D, N, 12), N, yaw frame.
        y: outputs with the pulse less those without, by phase, pulsed robot, direction, sample and
            responding robot, shape (P, n, D, N, n, 6), m, m/s, m/s, rad, rad, rad/s.
    """

    seed: int
    ticks: NDArray[np.int64]
    u: Array
    y: Array


@dataclass(frozen=True, slots=True)
class Responses:
    """Responses to every pulse: means over repetitions in worlds of different seeds.

    Attributes:
        seeds: of the worlds.
        ticks, u, y: as in `Repetition`.
        scatter: standard deviation of `y` between repetitions; NaN with fewer than two.
        lost: pulses left out because a robot fell, of all repetitions.
        pulses: walked in all repetitions.
    """

    seeds: tuple[int, ...]
    ticks: NDArray[np.int64]
    u: Array
    y: Array
    scatter: Array
    lost: int
    pulses: int


def average(repetitions: Sequence[Repetition]) -> Responses | None:
    """Means over the repetitions in which nobody fell; None if a pulse has no such repetition.

    Raises:
        PredictorFileError: they are of different teams or horizons.
    """
    shapes = {each.y.shape for each in repetitions}
    if len(shapes) > 1:
        raise PredictorFileError(
            "responses", f"some of the shapes {shapes}", "one", "delete them to measure anew"
        )
    u, y = (np.stack([getattr(each, name) for each in repetitions]) for name in ("u", "y"))
    whole = np.isfinite(y).all(axis=(-3, -2, -1))  # (repetition, phase, pulsed robot, direction)
    count = whole.sum(axis=0)
    if not count.all():
        return None
    kept = whole[..., None, None]
    divisor = count[..., None, None]
    mean_u = np.where(kept, u, 0.0).sum(axis=0) / divisor
    kept, divisor = kept[..., None], divisor[..., None]
    mean_y = np.where(kept, y, 0.0).sum(axis=0) / divisor
    squares = np.where(kept, (y - mean_y) ** 2, 0.0).sum(axis=0)
    freedom = np.where(divisor > 1, divisor - 1, 1)
    scatter = np.where(divisor > 1, np.sqrt(squares / freedom), np.nan)
    seeds = tuple(each.seed for each in repetitions)
    lost = int(whole.size - whole.sum())
    return Responses(seeds, repetitions[0].ticks, mean_u, mean_y, scatter, lost, whole.size)


def write_repetition(path: Path, measured: Repetition) -> None:
    """Keep measured responses; a file half written never has the name `path`."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_write(path) as partial, partial.open("wb") as file:
        np.savez_compressed(
            file, seed=measured.seed, ticks=measured.ticks, u=measured.u, y=measured.y
        )


def read_repetition(path: Path) -> Repetition:
    """Measured responses from a file.

    Raises:
        PredictorFileError: no such file, or not one of measured responses.
    """
    try:
        with open_npz(path) as archive:
            seed, ticks = int(archive["seed"]), as_measured("ticks", archive["ticks"], 1)
            u, y = _check_signals(archive["u"], archive["y"], len(ticks))
            return Repetition(seed, ticks.astype(np.int64), u, y)
    except UNREADABLE as error:
        raise PredictorFileError(
            f"responses {path}",
            str(error) or type(error).__name__,
            "a file of `quadriga probe`",
            "delete it to measure anew",
        ) from None


def _check_signals(u: Any, y: Any, phases: int) -> tuple[Array, Array]:
    """Forces and outputs of a file.

    Raises:
        one of UNREADABLE: they are none, or do not belong together.
    """
    u, y = as_measured("u", u, 5, gaps=True), as_measured("y", y, 6, gaps=True)
    team = y.shape[4]
    if y.shape[:4] != u.shape[:4] or y.shape[:2] != (phases, team):
        raise ValueError(f"u of shape {u.shape} with y of shape {y.shape}")
    if u.shape[4] != N_FORCES or y.shape[5] != N_OUTPUTS:
        raise ValueError(f"{u.shape[4]} forces and {y.shape[5]} outputs of a robot")
    return u, y
