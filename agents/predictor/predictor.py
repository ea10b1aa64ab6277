"""G, the data-driven state-transition matrix over N steps (eq. 6), its blocks (eq. 9), its fits."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from quadriga.agents.predictor.episode import (
    Episode,
    Layout,
    as_signal,
    check_episodes,
    everyone,
    team_layout,
    wrench_map,
)
from quadriga.agents.predictor.periodic import FACTORS, Period, PeriodicFactors, fit_periodic
from quadriga.agents.predictor.regression import (
    check_excitation,
    normal_equations,
    solve_pinv,
    solve_ridge,
    to_physical,
)
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError, did_you_mean
from quadriga.shared.robots.conventions import Array, neighbours
from quadriga.shared.topics import SAMPLE_MS

KINDS: Final = ("pinv", "ridge", "periodic")  # of fits
# Keys of the controller that act only in a failure and do not change the plant that is fitted.
_SAFETY_KEYS: Final = ("damping", "fall_tilt", "max_failures")
_KEYS: Final = {  # of the configuration, in the meta under their own names
    "team": ("robots", "robot", "yokes", "alternate_phase"),
    "planner": ("N", "T_ini", "interface"),
    "gait": ("stance_ms", "stand_ms"),
    "identification": ("neighbours", "ridge", "block_weight"),
}


@dataclass(frozen=True, slots=True)
class PredictorMeta:
    """The team and settings that a predictor was fitted for, and how; it fits no others.

    Attributes:
        kind: name of the fit, one of `KINDS`.
        phases: parts of the period with a G of their own (see `agents.gait.gait_phase`).
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
        known: dict[str, Any] = {
            key: getattr(getattr(config, section), key)
            for section, keys in _KEYS.items()
            for key in keys
        }
        known |= {"kind": config.identification.predictor, "response": config.response_file}
        controller = {k: v for k, v in asdict(config.controller).items() if k not in _SAFETY_KEYS}
        return cls(phases=1, controller=tuple(sorted(controller.items())), **known)

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
        plant, controller = body.get("plant"), tuple(sorted(body["controller"].items()))
        layout = plant and Layout(**{k: as_tuples(v) for k, v in plant.items()})
        return cls(**body | {"controller": controller, "plant": layout})

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


def as_tuples(value: Any) -> Any:
    """A value of JSON with tuples for its lists, however deep they are."""
    return tuple(map(as_tuples, value)) if isinstance(value, list) else value


@dataclass(frozen=True, slots=True, eq=False)
class Predictor:
    """y^i = Σ_j G_ij [u_ini^j; y_ini^j; u^j] in deviations and physical units (eq. 10).

    Attributes:
        meta: what it was fitted for.
        parts: G itself, shape (P, n, n, p N, W), read-only, one for each of the P phases; rows and
            columns are time-major (sample 0's inputs, sample 1's, …), of robots N and m, m/s, rad,
            rad/s. Or the factors of a periodic one, of which blocks are expanded when they are
            asked for.

    Raises:
        PredictorError: arrays of other shapes.
    """

    meta: PredictorMeta
    parts: Array | PeriodicFactors

    def __post_init__(self) -> None:
        arrays, n = self.arrays(), self.meta.robots
        agents = arrays["free" if "free" in arrays else "G"].shape[1:2]
        if agents != (n,):  # before the layout: a file may claim any number
            raise PredictorError("predictor", f"arrays of {agents} agents", f"{n}")
        layout, w = self.layout, len(arrays.get("wrench", ()))
        n = layout.agents
        expected = {
            "G": (n, n, layout.rows, layout.width),
            "response": (layout.N, n, w, n, layout.outputs),
            "free": (n, n, layout.rows, (w + layout.outputs) * layout.T_ini),
            "wrench": (layout.inputs,),
        }
        for name, array in arrays.items():
            first = self.phases if name == "G" else len(array)
            if array.shape != (first, *expected[name]):
                wanted = f"{(first, *expected[name])}"
                raise PredictorError(f"predictor.{name}", f"shape {array.shape}", wanted)
            array.setflags(write=False)

    @property
    def layout(self) -> Layout:
        """Its sizes and scales, those of the meta."""
        return self.meta.layout

    @property
    def phases(self) -> int:
        """P, the number of phases with a G of their own; `agents.gait.phase_of` chooses."""
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
        return self.block(i, j, phase)[:, self.layout.past :]

    def arrays(self) -> Mapping[str, Array]:
        """What it is made of, by name: with the meta all that a file must hold."""
        if isinstance(self.parts, PeriodicFactors):
            return {name: getattr(self.parts, name) for name in FACTORS}
        return {"G": self.parts}

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


# ---- fits


def fit(
    episodes: Sequence[Episode],
    meta: PredictorMeta,
    wrench: Array | None = None,
    response: Array | None = None,
) -> Predictor:
    """The fit that `meta.kind` names.

    - pinv: G = Y_f [U_p; Y_p; U_f]† (eq. 6).
    - ridge: row i minimises ‖Y_f^i − Σ_j G_ij Z_j‖² + ridge · M · (‖G_ii‖² + w² Σ_{j≠i} ‖G_ij‖²)
      with M columns: effects that the data do not clearly show are not attributed to the peers.
      Without this weight the agents' best responses to each other's last plans diverge.
    - periodic: a function of the phase in which no input acts backwards, see `periodic`; of a team
      that of the gait, with peers by their net wrench.

    Of `periodic` are `wrench`, from an agent's inputs to what they act by, (w, m), None: of the
    robot, and `response`, which stands for a fitted one, see `fit_periodic`.

    Raises:
        PredictorError: no data, too little, of another plant, or a singular problem.
    """
    layout, period = meta.layout, meta.period
    if meta.kind == "periodic":
        B = wrench_map(meta.robot) if wrench is None else wrench
        factors = fit_periodic(episodes, layout, period, B, response)
        return Predictor(replace(meta, phases=max(1, period.ticks // period.sample)), factors)
    regression, meta = normal_equations(episodes, layout), replace(meta, phases=1)
    if meta.kind == "pinv":
        meta = replace(meta, ridge=0.0, block_weight=1.0)
        x = solve_pinv(regression, layout)
    else:
        x = solve_ridge(regression, layout, meta.ridge, meta.block_weight)
    return Predictor(meta, to_physical(x, layout)[None])


def fit_plant(
    episodes: Sequence[Episode],
    kind: str = "pinv",
    T_ini: int = 4,
    N: int = 30,
    *,
    ridge: float = 1e-6,
    block_weight: float = 1.0,
    period: int = 1,
    input_map: ArrayLike | None = None,
) -> Predictor:
    """Fit a predictor of any plant.

    Signals are scaled by their root mean square before they are fitted, so that a ridge means the
    same for every plant.

    Args:
        episodes: of the plant, see `Episode.of`.
        kind: one of `KINDS`, see `fit`.
        T_ini: samples of the past that tell the plant's state: at least its lag.
        N: samples to predict.
        ridge: penalty per window on scaled columns, of `ridge`.
        block_weight: of `ridge` and several agents: the penalty on what one does to another is this
            squared times as large.
        period: of `periodic`: samples after which the plant repeats itself.
        input_map: of `periodic`: what the inputs of an agent act by, shape (w, m), such as the net
            wrench of forces; the identity if left out.

    Raises:
        PredictorError: an unknown kind, too little data, or inputs that do not excite the plant.

    Warns:
        UserWarning: a signal has a mean beyond its standard deviation; no fit has an intercept.
    """
    if kind not in KINDS:
        raise PredictorError("kind", repr(kind), ", ".join(KINDS), did_you_mean(kind, KINDS))
    for name, samples in (("T_ini", T_ini), ("N", N), ("period", period)):
        if isinstance(samples, bool) or not isinstance(samples, int | np.integer) or samples < 1:
            raise PredictorError(name, repr(samples), "a whole number of samples, at least 1")
    if (period > 1) != (kind == "periodic"):
        raise PredictorError("period", f"{period} of {kind!r}", "above 1 of 'periodic', else 1")
    if not (ridge >= 0.0 and block_weight > 0.0):
        got = f"{ridge:g}, {block_weight:g}"
        raise PredictorError("ridge, block_weight", got, "not negative, and positive")
    if not episodes:
        raise PredictorError("episodes", "none", "at least one")
    n, m, p = *episodes[0].u.shape[1:], episodes[0].y.shape[2]
    B = np.eye(m) if input_map is None else as_signal("input_map", input_map)[:, 0]
    if B.shape[1] != m:
        raise PredictorError("input_map", f"shape {B.shape}", f"(w, {m})")
    unscaled = Layout(n, m, p, T_ini, N, (1.0,) * m, (1.0,) * p, everyone(n))
    check_episodes(episodes, unscaled)
    inputs, outputs = zip(*(episode.deviations() for episode in episodes), strict=True)
    _check_variation(inputs, outputs)
    layout = replace(unscaled, u_scale=_sizes(inputs), y_scale=_sizes(outputs))
    meta = PredictorMeta(n, N, T_ini, kind, period, ridge, block_weight, plant=layout)
    if kind == "pinv" or ridge == 0.0:
        scaled = [episode.scaled_deviations(layout)[0] for episode in episodes]
        check_excitation(scaled, T_ini + N)
    return fit(episodes, meta, B / np.array(_sizes([u @ B.T for u in inputs]))[:, None])


def _check_variation(inputs: Sequence[Array], outputs: Sequence[Array]) -> None:
    """Refuse an input that never changes, and warn of a working point that is not zero."""
    for name, signals in (("u", inputs), ("y", outputs)):
        each = np.concatenate([signal.reshape(len(signal), -1) for signal in signals])
        spread = each.std(axis=0)
        still = spread <= 1e-12 * np.abs(each).max(axis=0)
        if name == "u" and still.any():
            raise PredictorError("u", f"columns {np.flatnonzero(still)} constant", "varying inputs")
        if (np.abs(each.mean(axis=0)) > spread)[~still].any():
            text = "has a mean beyond its standard deviation, and a fit has no intercept"
            warnings.warn(f"{name} {text}: hand in deviations from a working point", stacklevel=3)


def _sizes(signals: Sequence[Array]) -> tuple[float, ...]:
    """Root mean squares of the components of signals (T, n, dim); 1 where one is always zero."""
    squares = np.concatenate([signal.reshape(-1, signal.shape[2]) for signal in signals]) ** 2
    sizes = np.sqrt(squares.mean(axis=0))
    return tuple(np.where(sizes > 0.0, sizes, 1.0).tolist())
