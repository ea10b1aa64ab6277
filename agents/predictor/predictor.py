"""G, the data-driven state-transition matrix over N steps (eq. 6), and its blocks (eq. 9)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from quadriga.agents.predictor.episode import Layout, as_signal, everyone, team_layout
from quadriga.agents.predictor.periodic import Period, PeriodicFactors
from quadriga.shared.config.sections import Config
from quadriga.shared.config.yokes import neighbours
from quadriga.shared.errors import PredictorError
from quadriga.shared.robots.conventions import Array
from quadriga.shared.topics import SAMPLE_MS

# Keys of the controller that act only in a failure and do not change the plant that is fitted.
_SAFETY_KEYS: Final = ("damping", "fall_tilt", "max_failures")


@dataclass(frozen=True, slots=True)
class PredictorMeta:
    """The team and settings that a predictor was fitted for, and how; it fits no others.

    Attributes:
        kind: name of the fit, one of `quadriga.agents.predictor.fits.KINDS`.
        phases: parts of the period with a G of their own (see `time_grid.gait_phase`).
        neighbours: "all", or "yoked": G_ij is zero unless i and j are yoked.
        controller: the low level, which is part of G.
        stand_ms: where the gait's period, and with it phase 0, begins.
        response: of 'periodic': the file of measured responses that stands for fitted ones.
        plant: layout of a plant that is no team: what belongs to robots and gait is empty.
    """

    robots: int
    N: int
    T_ini: int
    kind: str
    phases: int
    ridge: float
    block_weight: float
    robot: str = ""
    interface: str = ""
    yokes: str = "complete"
    alternate_phase: bool = False
    stance_ms: int = 0
    stand_ms: int = 0
    controller: tuple[tuple[str, float | str | bool], ...] = ()
    neighbours: str = "all"
    response: str = ""
    plant: Layout | None = None

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
        body = asdict(self) | {"controller": dict(self.controller)}
        if self.plant is None:
            del body["plant"]
        return body

    @classmethod
    def from_dict(cls, body: dict[str, Any]) -> PredictorMeta:
        """The inverse of `to_dict`, also after JSON has made lists of tuples.

        Raises:
            TypeError, AttributeError, KeyError: fields are missing, unknown or of another type.
        """
        changes: dict[str, Any] = {"controller": tuple(sorted(body["controller"].items()))}
        if "plant" in body:
            given = body["plant"]
            members = tuple(tuple(agents) for agents in given["members"])
            scales = {name: tuple(given[name]) for name in ("u_scale", "y_scale", "commanded")}
            changes["plant"] = Layout(**given | scales | {"members": members})
        return cls(**body | changes)

    @property
    def layout(self) -> Layout:
        """Sizes, scales and members of the predictor, as the numerics take them."""
        if self.plant is not None:
            return self.plant
        n, members = self.robots, everyone(self.robots)
        if self.neighbours != "all":
            yoked = (neighbours(n, self.yokes, i) for i in range(n))
            members = tuple(tuple(sorted({i, *peers})) for i, peers in enumerate(yoked))
        return team_layout(n, self.T_ini, self.N, members)

    @property
    def period(self) -> Period:
        """After how long the plant repeats itself: two stance times, or that of the plant."""
        if self.plant is not None:
            return Period(self.phases)
        return Period(2 * self.stance_ms, self.stand_ms, SAMPLE_MS)

    @property
    def width(self) -> int:
        """Columns of a block: length of one agent's [u_ini; y_ini; u]."""
        return self.layout.width

    @property
    def past(self) -> int:
        """Columns of a block that belong to [u_ini; y_ini]."""
        return self.layout.past


@dataclass(frozen=True, slots=True)
class Predictor:
    """y^i = Σ_j G_ij [u_ini^j; y_ini^j; u^j] in deviations and physical units (eq. 10).

    Attributes:
        meta: what it was fitted for.
        parts: G itself, shape (P, n, n, p N, W), read-only, one for each of the P phases; rows and
            columns are time-major (sample 0's inputs, sample 1's, …), of robots N and m, m/s, rad,
            rad/s. Or the factors of a periodic one, of which blocks are expanded when they are
            asked for.
        layout: its sizes and scales, those of the meta.

    Raises:
        PredictorError: arrays of other shapes.
    """

    meta: PredictorMeta
    parts: Array | PeriodicFactors
    layout: Layout = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        layout = self.meta.layout
        object.__setattr__(self, "layout", layout)
        if isinstance(self.parts, PeriodicFactors):
            self.parts.check(layout)
            return
        n = layout.agents
        expected = (self.phases, n, n, layout.rows, layout.width)
        if self.parts.shape != expected:
            raise PredictorError("predictor.G", f"shape {self.parts.shape}", f"{expected}")
        self.parts.setflags(write=False)

    @property
    def phases(self) -> int:
        """P, the number of phases with a G of their own; `time_grid.phase_of` chooses."""
        return self.meta.phases

    @property
    def G(self) -> Array:
        """All blocks at once, (P, n, n, p N, W); large if it is periodic."""
        if not isinstance(self.parts, PeriodicFactors):
            return self.parts
        agents, phases = range(self.layout.agents), range(self.phases)
        return np.array([[[self.block(i, j, p) for j in agents] for i in agents] for p in phases])

    def block(self, i: int, j: int, phase: int = 0) -> Array:
        """G_ij of a phase, the effect of agent j on agent i. Shape (p N, W)."""
        if isinstance(self.parts, PeriodicFactors):
            return self.parts.block(i, j, phase, self.phases)
        block: Array = self.parts[phase, i, j]
        return block

    def future_block(self, i: int, j: int, phase: int = 0) -> Array:
        """The columns of G_ij that multiply the future inputs. Shape (p N, m N)."""
        if isinstance(self.parts, PeriodicFactors):
            return self.parts.future_block(i, j, phase, self.phases)
        block: Array = self.parts[phase, i, j, :, self.layout.past :]
        return block

    def couples(self, i: int, j: int) -> bool:
        """Whether anything that agent j does has an effect on agent i."""
        if isinstance(self.parts, PeriodicFactors):
            return self.parts.couples(i, j)
        return bool(self.parts[:, i, j].any())

    def arrays(self) -> Mapping[str, Array]:
        """What it is made of, by name: with the meta all that a file must hold."""
        return self.parts.arrays() if isinstance(self.parts, PeriodicFactors) else {"G": self.parts}

    def predict(self, z: Array, phase: int = 0) -> Array:
        """Predicted output deviations of all agents.

        Args:
            z: per agent [u_ini; y_ini; u], shape (n, W) or, for many windows at once, (n, W, C).
            phase: that the end of [u_ini; y_ini] lies in.

        Returns:
            Shape (n, p N) or (n, p N, C).
        """
        stacked, agents = z.reshape(-1, *z.shape[2:]), range(self.layout.agents)
        rows = (np.concatenate([self.block(i, j, phase) for j in agents], axis=1) for i in agents)
        return np.stack([row @ stacked for row in rows])

    def forecast(
        self, past_u: ArrayLike, past_y: ArrayLike, future_u: ArrayLike, phase: int = 0
    ) -> Array:
        """Predicted output deviations over the horizon, sample by sample.

        Args:
            past_u: the last T_ini inputs, oldest first, shape (T_ini, m), or (T_ini, n, m).
            past_y: the outputs that belong to them, shape (T_ini, p), or (T_ini, n, p).
            future_u: inputs of the horizon, shape (N, m), or (N, n, m).
            phase: number of the horizon's first sample, of a periodic plant.

        Returns:
            Shape (N, p), or (N, n, p).

        Raises:
            PredictorError: another shape.
        """
        layout = self.layout
        n, m, p = layout.agents, layout.inputs, layout.outputs
        parts = []
        for name, values, shape in (
            ("past_u", past_u, (layout.T_ini, n, m)),
            ("past_y", past_y, (layout.T_ini, n, p)),
            ("future_u", future_u, (layout.N, n, m)),
        ):
            signal = as_signal(name, values)
            if signal.shape != shape:
                raise PredictorError(name, f"shape {signal.shape}", f"{shape}")
            parts.append(signal.transpose(1, 0, 2).reshape(n, -1))
        y = self.predict(np.concatenate(parts, axis=1), phase % self.phases)
        forecast: Array = y.reshape(n, layout.N, p).transpose(1, 0, 2)
        return forecast[:, 0] if np.ndim(future_u) == 2 else forecast


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
