"""G, the data-driven state-transition matrix over N steps (eq. 6), and its blocks (eq. 9)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np

from quadriga.agents.predictor.episode import Layout, everyone, team_layout
from quadriga.agents.predictor.periodic import PeriodicFactors
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError
from quadriga.shared.robots.conventions import N_FORCES, N_OUTPUTS, Array, neighbours

# Keys of the controller that act only in a failure and do not change the plant that is fitted.
_SAFETY_KEYS: Final = ("damping", "fall_tilt", "max_failures")


@dataclass(frozen=True, slots=True)
class PredictorMeta:
    """The team and settings that a predictor was fitted for, and how; it fits no others.

    Attributes:
        kind: name of the fit, a key of `quadriga.agents.predictor.fits.FITS`.
        phases: parts of the gait's period with a G of their own (see `time_grid.gait_phase`).
        neighbours: "all", or "yoked": G_ij is zero unless i and j are yoked.
        controller: the low level, which is part of G.
        stand_ms: where the gait's period, and with it phase 0, begins.
        response: of 'periodic': the file of measured responses that stands for fitted ones.
    """

    robots: int
    robot: str
    N: int
    T_ini: int
    interface: str
    yokes: str
    alternate_phase: bool
    stance_ms: int
    stand_ms: int
    controller: tuple[tuple[str, float | str | bool], ...]
    kind: str
    phases: int
    neighbours: str
    ridge: float
    block_weight: float
    response: str = ""

    @classmethod
    def of(cls, config: Config) -> PredictorMeta:
        """The meta of a predictor fitted for `config`."""
        controller = {k: v for k, v in asdict(config.controller).items() if k not in _SAFETY_KEYS}
        ident = config.identification
        return cls(
            robots=config.team.robots,
            robot=config.team.robot,
            N=config.planner.N,
            T_ini=config.planner.T_ini,
            interface=config.planner.interface,
            yokes=config.team.yokes,
            alternate_phase=config.team.alternate_phase,
            stance_ms=config.gait.stance_ms,
            stand_ms=config.gait.stand_ms,
            controller=tuple(sorted(controller.items())),
            kind=ident.predictor,
            phases=1,
            neighbours=ident.neighbours,
            ridge=ident.ridge,
            block_weight=ident.block_weight,
            response=config.response_file,
        )

    def to_dict(self) -> dict[str, Any]:
        """A dictionary that can be written as JSON."""
        return asdict(self) | {"controller": dict(self.controller)}

    @classmethod
    def from_dict(cls, body: dict[str, Any]) -> PredictorMeta:
        """The inverse of `to_dict`.

        Raises:
            TypeError, AttributeError, KeyError: fields are missing, unknown or of another type.
        """
        return cls(**body | {"controller": tuple(sorted(body["controller"].items()))})

    @property
    def layout(self) -> Layout:
        """Sizes, scales and members of the predictor, as the numerics take them."""
        n, members = self.robots, everyone(self.robots)
        if self.neighbours != "all":
            yoked = (neighbours(n, self.yokes, i) for i in range(n))
            members = tuple(tuple(sorted({i, *peers})) for i, peers in enumerate(yoked))
        return team_layout(n, self.T_ini, self.N, members)

    @property
    def width(self) -> int:
        """Columns of a block: length of one robot's [u_ini; y_ini; u]."""
        return self.past + N_FORCES * self.N

    @property
    def past(self) -> int:
        """Columns of a block that belong to [u_ini; y_ini]."""
        return (N_FORCES + N_OUTPUTS) * self.T_ini


@dataclass(frozen=True, slots=True)
class Predictor:
    """y^i = Σ_j G_ij [u_ini^j; y_ini^j; u^j] in deviations and physical units (eq. 10).

    Attributes:
        meta: what it was fitted for.
        parts: G itself, shape (P, n, n, 6 N, 18 T_ini + 12 N), read-only, one for each of the P
            phases; rows and columns are time-major (sample 0's twelve forces, sample 1's twelve,
            …), N and m, m/s, rad, rad/s. Or the factors of a periodic one, of which blocks are
            expanded when they are asked for.
        condition: number of the regression it was fitted by, penalty included; None: unknown.

    Raises:
        PredictorError: arrays of other shapes.
    """

    meta: PredictorMeta
    parts: Array | PeriodicFactors
    condition: float | None = None

    def __post_init__(self) -> None:
        if isinstance(self.parts, PeriodicFactors):
            self.parts.check(self.meta.layout)
            return
        n = self.meta.robots
        expected = (self.meta.phases, n, n, N_OUTPUTS * self.meta.N, self.meta.width)
        if self.parts.shape != expected:
            raise PredictorError("predictor.G", f"shape {self.parts.shape}", f"{expected}")
        self.parts.setflags(write=False)

    @property
    def phases(self) -> int:
        """P, the number of phases with a G of their own; `time_grid.phase_of` chooses."""
        return self.meta.phases

    @property
    def G(self) -> Array:
        """All blocks at once, (P, n, n, 6 N, W); large if it is periodic."""
        if not isinstance(self.parts, PeriodicFactors):
            return self.parts
        robots, phases = range(self.meta.robots), range(self.phases)
        return np.array([[[self.block(i, j, p) for j in robots] for i in robots] for p in phases])

    def block(self, i: int, j: int, phase: int = 0) -> Array:
        """G_ij of a phase, the effect of agent j on agent i. Shape (6 N, 18 T_ini + 12 N)."""
        if isinstance(self.parts, PeriodicFactors):
            return self.parts.block(i, j, phase, self.phases)
        block: Array = self.parts[phase, i, j]
        return block

    def future_block(self, i: int, j: int, phase: int = 0) -> Array:
        """The columns of G_ij that multiply the future forces. Shape (6 N, 12 N)."""
        if isinstance(self.parts, PeriodicFactors):
            return self.parts.future_block(i, j, phase, self.phases)
        block: Array = self.parts[phase, i, j, :, self.meta.past :]
        return block

    def row(self, i: int, phase: int = 0) -> Array:
        """Blocks G_i1 … G_in side by side. Shape (6 N, n (18 T_ini + 12 N))."""
        robots = range(self.meta.robots)
        return np.concatenate([self.block(i, j, phase) for j in robots], axis=1)

    def couples(self, i: int, j: int) -> bool:
        """Whether anything that robot j does has an effect on robot i."""
        if isinstance(self.parts, PeriodicFactors):
            return self.parts.couples(i, j)
        return bool(self.parts[:, i, j].any())

    @property
    def nbytes(self) -> int:
        """Memory of what it is made of."""
        return sum(array.nbytes for array in self.arrays().values())

    def arrays(self) -> Mapping[str, Array]:
        """What it is made of, by name: with the meta all that a file must hold."""
        return self.parts.arrays() if isinstance(self.parts, PeriodicFactors) else {"G": self.parts}

    def predict(self, z: Array, phase: int = 0) -> Array:
        """Predicted output deviations of the whole team.

        Args:
            z: per robot [u_ini; y_ini; u], shape (n, 18 T_ini + 12 N) or, for many windows
                at once, (n, 18 T_ini + 12 N, C).
            phase: that the end of [u_ini; y_ini] lies in.

        Returns:
            Shape (n, 6 N) or (n, 6 N, C).
        """
        stacked = z.reshape(-1, *z.shape[2:])
        return np.stack([self.row(i, phase) @ stacked for i in range(self.meta.robots)])


def check_sizes(config: Config, predictor: Predictor) -> None:
    """Refuse a predictor whose sizes are not the configuration's.

    Raises:
        PredictorError: it is of another team or horizon.
    """
    meta, planner = predictor.meta, config.planner
    got = meta.robots, meta.N, meta.T_ini
    expected = config.team.robots, planner.N, planner.T_ini
    if got != expected:
        raise PredictorError(
            "predictor", f"(robots, N, T_ini) = {got}", f"{expected}", "of another team?"
        )
