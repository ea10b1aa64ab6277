"""Raw stacked data of one uninterrupted walk, and their deviations, which all fits use."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from quadriga.agents.predictor.hankel import windows
from quadriga.agents.predictor.layout import Layout, everyone
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError
from quadriga.shared.robot.conventions import N_FORCES, N_OUTPUTS, Array
from quadriga.shared.wire.messages import Reference

U_SCALE: Final = 10.0  # N
Y_SCALE: Final = np.array([0.005, 0.1, 0.1, 0.02, 0.02, 0.2])  # m, m/s, m/s, rad, rad, rad/s
SIGNALS: Final = ("u", "u_nominal", "y", "y_base")  # an episode's arrays


@dataclass(frozen=True, slots=True)
class Episode:
    """One walk of the whole team at 100 Hz; u_k is the mean over the 10 ms that end with y_k.

    Attributes:
        u: forces of all robots, shape (T, n, 12), N.
        u_nominal: forces that deviations are counted from, shape (T, n, 12), N.
        y: outputs z, vx, vy, roll, pitch, wz, shape (T, n, 6), m, m/s, rad, rad/s.
        y_base: outputs that deviations are counted from (see `output_base`), shape (T, n, 6).
        first_tick: world tick at the end of sample 0, which determines the gait's phase, ms.

    Raises:
        PredictorError: shapes that do not belong together, or numbers that are not finite.
    """

    u: Array
    u_nominal: Array
    y: Array
    y_base: Array
    first_tick: int

    def __post_init__(self) -> None:
        lead = self.u.shape[:2]
        for name in SIGNALS:
            array = getattr(self, name)
            expected = (*lead, N_FORCES if name.startswith("u") else N_OUTPUTS)
            if array.shape != expected:
                raise PredictorError(f"episode.{name}", f"shape {array.shape}", f"{expected}")
            if not np.isfinite(array).all():
                raise PredictorError(
                    f"episode.{name}", "NaN or infinity", "finite numbers", "a robot fell?"
                )

    @property
    def samples(self) -> int:
        """T, the number of samples."""
        return len(self.u)

    @property
    def robots(self) -> int:
        """The size n of the team."""
        return int(self.u.shape[1])

    def deviations(self) -> tuple[Array, Array]:
        """Deviations u − u_nominal, shape (T, n, 12), and y − y_base, shape (T, n, 6)."""
        return self.u - self.u_nominal, self.y - self.y_base

    def scaled_deviations(self) -> tuple[Array, Array]:
        """Deviations over their scales, robots stacked: shapes (T, 12 n) and (T, 6 n)."""
        du, dy = self.deviations()
        return ((du / U_SCALE).reshape(self.samples, -1), (dy / Y_SCALE).reshape(self.samples, -1))

    def windows(self, T_ini: int, N: int) -> tuple[Array, Array]:
        """Every window of deviations: a predictor's input and the output it should predict.

        Returns:
            z, shape (n, 18 T_ini + 12 N, C): per robot [u_ini; y_ini; u], time-major;
            y, shape (n, 6 N, C); C = T − T_ini − N + 1 windows.
        """
        return windows(*self.deviations(), T_ini, N)


def team_layout(
    robots: int, T_ini: int, N: int, members: tuple[tuple[int, ...], ...] | None = None
) -> Layout:
    """The layout of a predictor of a team: forces and outputs of robots, with their scales.

    Args:
        robots: in the team.
        T_ini: estimation horizon.
        N: control horizon.
        members: of each robot: whose columns explain its outputs; None: everybody's.
    """
    u_scale, y_scale = (U_SCALE,) * N_FORCES, tuple(Y_SCALE.tolist())
    whose = everyone(robots) if members is None else members
    return Layout(robots, N_FORCES, N_OUTPUTS, T_ini, N, u_scale, y_scale, whose)


def output_base(config: Config, reference: Reference) -> Array:
    """The outputs that deviations are counted from while `reference` is in force. Shape (6,).

    With the interface "feedforward" the low level already follows the reference, so the base is the
    commanded outputs; with "force" the base is standing still at nominal height.
    """
    if config.planner.interface == "force":
        return np.array([config.robot.stand_height, 0.0, 0.0, 0.0, 0.0, 0.0])
    return commanded_outputs(reference)


def commanded_outputs(reference: Reference) -> Array:
    """The commanded outputs: z, vx, vy, 0, 0, wz. Shape (6,)."""
    return np.array([reference.height, reference.vx, reference.vy, 0.0, 0.0, reference.wz])
