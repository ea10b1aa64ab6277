"""Data of a plant, and how its predictor is laid out: sizes, scales, episodes.

A plant has n agents, each with m inputs and p outputs: a tank with its pumps is one agent, a team
of yoked robots is n agents with twelve forces and six outputs each.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike

from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError
from quadriga.shared.messages import Reference
from quadriga.shared.robots.conventions import N_FORCES, N_LEGS, N_OUTPUTS, Array
from quadriga.shared.robots.registry import ROBOTS

_MOST: Final = 1e100  # of a signal: its squares and their sums are finite too
SIGNALS: Final = ("u", "u_nominal", "y", "y_base")  # an episode's arrays


@dataclass(frozen=True, slots=True)
class Layout:
    """Sizes and scales of a predictor.

    Attributes:
        agents: n, parts of the plant with inputs and outputs of their own.
        inputs: m, of each agent.
        outputs: p, of each agent.
        T_ini: samples of the past.
        N: samples of the horizon.
        u_scale: of an agent's inputs, m numbers; fits see inputs divided by them.
        y_scale: of its outputs, p numbers.
        members: of every agent: whose columns explain its outputs, in order, its own among them.
        commanded: outputs whose base moves with a command that is known beforehand.
    """

    agents: int
    inputs: int
    outputs: int
    T_ini: int
    N: int
    u_scale: tuple[float, ...]
    y_scale: tuple[float, ...]
    members: tuple[tuple[int, ...], ...]
    commanded: tuple[int, ...] = ()

    @property
    def past(self) -> int:
        """Columns of a block that belong to [u_ini; y_ini]."""
        return (self.inputs + self.outputs) * self.T_ini

    @property
    def width(self) -> int:
        """W, columns of a block: length of one agent's [u_ini; y_ini; u]."""
        return self.past + self.inputs * self.N

    @property
    def rows(self) -> int:
        """Rows of a block: length of one agent's outputs over the horizon, p N."""
        return self.outputs * self.N

    def scales(self) -> tuple[Array, Array]:
        """Scales of one agent's [u_ini; y_ini; u], shape (W,), and of its y, shape (p N,)."""
        u, y = np.array(self.u_scale), np.array(self.y_scale)
        z = np.concatenate([np.tile(u, self.T_ini), np.tile(y, self.T_ini), np.tile(u, self.N)])
        return z, np.tile(y, self.N)


def everyone(agents: int) -> tuple[tuple[int, ...], ...]:
    """The `members` of a plant in which each agent's outputs may depend on all agents."""
    return (tuple(range(agents)),) * agents


@dataclass(frozen=True, slots=True)
class Episode:
    """A recording without gaps, of robots at 100 Hz: y_k may depend on u_k and all before.

    Attributes:
        u: inputs, shape (T, n, m); of robots forces, means over the 10 ms that end with y_k, N.
        u_nominal: inputs that deviations are counted from, shape (T, n, m).
        y: outputs, shape (T, n, p); of robots z, vx, vy, roll, pitch, wz, m, m/s, rad, rad/s.
        y_base: outputs that deviations are counted from (see `output_base`), shape (T, n, p).
        first_tick: tick at the end of sample 0, which tells the phase of a plant that repeats
            itself; of robots ms.

    Raises:
        PredictorError: shapes that do not belong together, or numbers that are not finite.
    """

    u: Array
    u_nominal: Array
    y: Array
    y_base: Array
    first_tick: int

    def __post_init__(self) -> None:
        for name in SIGNALS:
            array, dims = getattr(self, name), (self.u if name[0] == "u" else self.y).shape[2:]
            expected = (*self.u.shape[:2], *dims)
            if array.ndim != 3 or array.shape != expected:
                raise PredictorError(f"episode.{name}", f"shape {array.shape}", f"{expected}")
            if not np.isfinite(array).all():
                raise PredictorError(
                    f"episode.{name}", "NaN or infinity", "finite numbers", "a robot fell?"
                )

    @classmethod
    def of(cls, u: ArrayLike, y: ArrayLike, begin: int = 0) -> Episode:
        """A recording of any plant, with nothing subtracted.

        A plant that is linear about a working point needs deviations from it: no fit has an
        intercept.

        Args:
            u: inputs, shape (T, m), or (T, n, m) of n agents.
            y: outputs, shape (T, p), or (T, n, p).
            begin: number of the first sample, which only a periodic plant depends on.
        """
        inputs, outputs = as_signal("u", u), as_signal("y", y)
        return cls(inputs, np.zeros_like(inputs), outputs, np.zeros_like(outputs), begin + 1)

    @property
    def samples(self) -> int:
        """T, the number of samples."""
        return len(self.u)

    def deviations(self) -> tuple[Array, Array]:
        """Deviations u − u_nominal, shape (T, n, m), and y − y_base, shape (T, n, p)."""
        return self.u - self.u_nominal, self.y - self.y_base

    def scaled_deviations(self, layout: Layout) -> tuple[Array, Array]:
        """Deviations over their scales, agents stacked: shapes (T, m n) and (T, p n)."""
        du, dy = self.deviations()
        u, y = du / np.array(layout.u_scale), dy / np.array(layout.y_scale)
        return u.reshape(self.samples, -1), y.reshape(self.samples, -1)

    def windows(self, T_ini: int, N: int) -> tuple[Array, Array]:
        """Every window of deviations: a predictor's input and the output it should predict.

        Returns:
            z, shape (n, (m + p) T_ini + m N, C): per agent [u_ini; y_ini; u], time-major;
            y, shape (n, p N, C); C = T − T_ini − N + 1 windows.
        """
        u, y = (
            # (C, n, dim, L) → (n, L, dim, C)
            np.transpose(sliding_window_view(x, T_ini + N, axis=0), (1, 3, 2, 0))
            for x in self.deviations()
        )
        n, _, _, count = u.shape
        parts = (u[:, :T_ini], y[:, :T_ini], u[:, T_ini:])
        z = np.concatenate([part.reshape(n, -1, count) for part in parts], axis=1)
        return z, y[:, T_ini:].reshape(n, -1, count)


def as_signal(name: str, values: ArrayLike) -> Array:
    """A signal with an axis of agents, (T, n, dim), which may be given without, (T, dim).

    Raises:
        PredictorError: no array of real, finite numbers up to 1e100 without a mask; other axes.
    """
    if np.ma.is_masked(values):
        cause = "split the data into episodes there"
        raise PredictorError(name, "masked samples", "numbers", cause)
    try:
        array = np.asarray(values).astype(np.float64, casting="same_kind")
    except (TypeError, ValueError):
        raise PredictorError(name, "something else", "an array of real numbers") from None
    if not (np.abs(array) <= _MOST).all():  # nor is NaN
        got = "NaN, infinity or too large numbers"
        raise PredictorError(name, got, f"finite numbers up to {_MOST:g}", "samples were lost?")
    if array.ndim == 2:
        array = array[:, None]
    if array.ndim != 3:
        axes = "(samples, components), or (samples, agents, components)"
        raise PredictorError(name, f"shape {array.shape}", axes)
    return array


def check_episodes(episodes: Sequence[Episode], layout: Layout) -> None:
    """Refuse data that no fit of this layout can use.

    Raises:
        PredictorError: no data, too little, or of another plant.
    """
    if not episodes:
        raise PredictorError("episodes", "none", "at least one", "did every walk end in a fall?")
    expected, least = (layout.agents, layout.inputs, layout.outputs), layout.T_ini + layout.N
    for each in episodes:
        got = *each.u.shape[1:], each.y.shape[2]
        if got != expected:
            name = f"(agents, inputs, outputs) = {got}"
            raise PredictorError("episode", name, f"{expected}", "of another plant")
        if each.samples < least:
            got_samples = f"{each.samples} samples"
            raise PredictorError("episode", got_samples, f"at least {least}", "cut short by a fall")


# ---- a team of robots

U_SCALE: Final = 10.0  # N
Y_SCALE: Final = np.array([0.005, 0.1, 0.1, 0.02, 0.02, 0.2])  # m, m/s, m/s, rad, rad, rad/s
N_WRENCH: Final = 6  # fx, fy, fz, mx, my, mz
_FORCE_SCALE: Final = 40.0  # N: two stance feet with 20 N each
_COMMANDED: Final = (1, 2, 5)  # vx, vy, wz


def team_layout(
    robots: int, T_ini: int, N: int, members: tuple[tuple[int, ...], ...] | None = None
) -> Layout:
    """The layout of a predictor of a team; None: everybody's columns explain everybody."""
    sizes = robots, N_FORCES, N_OUTPUTS, T_ini, N
    u_scale, y_scale = (U_SCALE,) * N_FORCES, tuple(Y_SCALE.tolist())
    return Layout(*sizes, u_scale, y_scale, members or everyone(robots), _COMMANDED)


def output_base(config: Config, reference: Reference) -> Array:
    """The outputs that deviations are counted from while `reference` is in force. Shape (6,).

    With the interface "feedforward" the low level follows the reference, so the base is the
    commanded outputs; with "force" it is standing still at nominal height.
    """
    if config.planner.interface == "force":
        return np.array([config.robot.stand_height, 0.0, 0.0, 0.0, 0.0, 0.0])
    return commanded_outputs(reference)


def commanded_outputs(reference: Reference) -> Array:
    """The commanded outputs: z, vx, vy, 0, 0, wz. Shape (6,)."""
    return np.array([reference.height, reference.vx, reference.vy, 0.0, 0.0, reference.wz])


def wrench_map(kind: str) -> Array:
    """From the forces of four feet to their net wrench, in units of `_FORCE_SCALE`. Shape (6, 12).

    Moments are about the point on the ground under the trunk, with the feet under their hips; their
    unit is that of the force times the distance of a foot from this point. So sideways forces alone
    have no moment about the horizontal axes.

    Args:
        kind: of robot, a key of `ROBOTS`.
    """
    feet = ROBOTS[kind].feet_under_hips
    (x, y), moments = feet.T, np.zeros((3, N_LEGS, 3))
    moments[0, :, 2], moments[1, :, 2], moments[2, :, 0], moments[2, :, 1] = y, -x, -y, x
    lever = float(np.linalg.norm(feet, axis=1).mean())
    forces = np.tile(np.eye(3)[:, None], (1, N_LEGS, 1))
    return np.concatenate([forces, moments / lever]).reshape(N_WRENCH, N_FORCES) / _FORCE_SCALE
