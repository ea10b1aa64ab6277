"""What a predictor is laid out for, and the data of a team: sizes, scales, episodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from quadriga.agents.predictor.hankel import windows
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError
from quadriga.shared.messages import Reference
from quadriga.shared.robots.conventions import N_FORCES, N_LEGS, N_OUTPUTS, Array
from quadriga.shared.robots.registry import ROBOTS

U_SCALE: Final = 10.0  # N
Y_SCALE: Final = np.array([0.005, 0.1, 0.1, 0.02, 0.02, 0.2])  # m, m/s, m/s, rad, rad, rad/s
N_WRENCH: Final = 6  # fx, fy, fz, mx, my, mz
_FORCE_SCALE: Final = 40.0  # N: two stance feet with 20 N each
SIGNALS: Final = ("u", "u_nominal", "y", "y_base")  # an episode's arrays


@dataclass(frozen=True, slots=True)
class Layout:
    """How a predictor of any plant is laid out; nothing in it is about robots.

    Attributes:
        agents: n, parts of the plant with inputs and outputs of their own.
        inputs: m, of each agent.
        outputs: p, of each agent.
        T_ini: samples of the past.
        N: samples of the horizon.
        u_scale: of an agent's inputs, m numbers; fits see inputs divided by them.
        y_scale: of its outputs, p numbers.
        members: of every agent: whose columns explain its outputs, in order, itself among them.
    """

    agents: int
    inputs: int
    outputs: int
    T_ini: int
    N: int
    u_scale: tuple[float, ...]
    y_scale: tuple[float, ...]
    members: tuple[tuple[int, ...], ...]

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

    def strangers(self, i: int) -> list[int]:
        """Agents whose columns do not explain the outputs of agent `i`."""
        return [j for j in range(self.agents) if j not in self.members[i]]


def everyone(agents: int) -> tuple[tuple[int, ...], ...]:
    """The `members` of a plant in which each agent's outputs may depend on all agents."""
    return (tuple(range(agents)),) * agents


def scales(layout: Layout) -> tuple[Array, Array]:
    """Scales of one agent's [u_ini; y_ini; u], shape (W,), and y, shape (p N,)."""
    u, y = np.array(layout.u_scale), np.array(layout.y_scale)
    parts = [np.tile(u, layout.T_ini), np.tile(y, layout.T_ini), np.tile(u, layout.N)]
    return np.concatenate(parts), np.tile(y, layout.N)


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


def wrench_map(kind: str) -> Array:
    """From the forces of four feet to their net wrench, in units of `_FORCE_SCALE`.

    Moments are about the point on the ground under the trunk, with the feet under their hips; their
    unit is that of the force times the distance of a foot from this point. So sideways forces alone
    have no moment about the horizontal axes. Shape (6, 12).

    Args:
        kind: of robot, a key of `ROBOTS`.
    """
    feet = ROBOTS[kind].feet_under_hips
    moments = np.zeros((3, N_LEGS, 3))
    moments[0, :, 2] = feet[:, 1]
    moments[1, :, 2] = -feet[:, 0]
    moments[2, :, 0], moments[2, :, 1] = -feet[:, 1], feet[:, 0]
    lever = float(np.linalg.norm(feet, axis=1).mean())
    forces = np.tile(np.eye(3)[:, None], (1, N_LEGS, 1))
    full = np.concatenate([forces, moments / lever]) / _FORCE_SCALE
    return full.reshape(N_WRENCH, N_FORCES)
