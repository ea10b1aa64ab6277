"""Data-driven predictive control of any plant: with a predictor (eq. 7) or the data alone (eq. 5).

controller = DataDrivenController(predictor, PlanWeights(Q=3.0, R=1e-4))
u = controller.plan(past_u, past_y, reference).u[0]
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, NamedTuple

import daqp
import numpy as np
from numpy.typing import ArrayLike
from scipy import linalg

from quadriga.agents.predictor.deepc import Reduction, input_output_rows, reduce_signals
from quadriga.agents.predictor.episode import Layout
from quadriga.agents.predictor.hankel import mosaic
from quadriga.agents.predictor.plant import Data, PlantPredictor, as_numbers, as_signal, unstack
from quadriga.agents.predictor.regression import scaled_blocks
from quadriga.shared.errors import PredictorError
from quadriga.shared.robots.conventions import Array

_FAR: Final = 1e30  # DAQP's infinity
_STATUS: Final = MappingProxyType({-1: "infeasible", -2: "cycling", -4: "iteration limit"})
_MAX_RESIDUAL: Final = 1e-6  # an answer with a larger one is not used, whatever the solver says
_APART: Final = "weights that are many orders of magnitude apart"


@dataclass(frozen=True, slots=True, eq=False)
class PlanWeights:
    """Weights in the units of the data; a number, or one of each component of an agent.

    Attributes:
        Q: of the squared error of outputs against their reference.
        R: of the squared distance of inputs from theirs.
        lambda_g: λ_g of DeePC (eq. 5), of ‖g‖².
        lambda_sigma: λ_σ of DeePC, of the squared change of past outputs.
    """

    Q: ArrayLike = 1.0
    R: ArrayLike = 1.0
    lambda_g: float = 1.0
    lambda_sigma: float = 1e5

    def over_horizon(self, layout: Layout) -> tuple[Array, Array]:
        """Q of the outputs and R of the inputs over the horizon, scaled, agents stacked.

        Raises:
            PredictorError: a weight of another shape, or not positive.
        """
        weights = []
        for name, scale in (("Q", layout.y_scale), ("R", layout.u_scale)):
            array, dim = as_numbers(f"weights.{name}", getattr(self, name)), len(scale)
            if array.shape not in ((), (dim,)):
                raise PredictorError(
                    f"weights.{name}", f"shape {array.shape}", f"a number, or {dim} of them"
                )
            stage = np.broadcast_to(array, (dim,)) * np.array(scale) ** 2
            weights.append(np.tile(stage, layout.agents * layout.N))
        Q, R = weights
        if Q.min() < 0.0 or not Q.any():
            raise PredictorError(
                "weights.Q", f"{self.Q}", "no number below 0, and not all of them 0"
            )
        if not R.min() > 0.0:
            raise PredictorError("weights.R", f"{self.R}", "numbers above 0")
        for name in ("lambda_g", "lambda_sigma"):
            if not getattr(self, name) > 0.0:
                raise PredictorError(f"weights.{name}", f"{getattr(self, name):g}", "above 0")
        return Q, R


@dataclass(frozen=True, slots=True, eq=False)
class PlanBounds:
    """Bounds in the units of the data; a number, or one of each component of an agent.

    Attributes:
        u_min, u_max: of the inputs.
        y_min, y_max: of the predicted outputs.
    """

    u_min: ArrayLike = -np.inf
    u_max: ArrayLike = np.inf
    y_min: ArrayLike = -np.inf
    y_max: ArrayLike = np.inf

    def over_horizon(self, layout: Layout, signal: str) -> tuple[Array, Array]:
        """Lower and upper bounds of "u" or "y" over the horizon, scaled, agents stacked.

        Raises:
            PredictorError: bounds of another shape, or that contradict each other.
        """
        scale = np.array(layout.u_scale if signal == "u" else layout.y_scale)
        arrays = []
        for name in (f"{signal}_min", f"{signal}_max"):
            array = np.asarray(getattr(self, name), dtype=np.float64)
            if array.shape not in ((), scale.shape) or np.isnan(array).any():
                raise PredictorError(
                    f"bounds.{name}", f"shape {array.shape} or NaN", f"a number, or {len(scale)}"
                )
            arrays.append(np.broadcast_to(array, scale.shape))
        if (arrays[0] > arrays[1]).any():
            raise PredictorError(
                f"bounds.{signal}_min", f"{arrays[0]} above {arrays[1]}", "at most the upper bound"
            )
        low, high = (np.tile(array / scale, layout.agents * layout.N) for array in arrays)
        return low, high


DEFAULT_WEIGHTS: Final = PlanWeights()
UNBOUNDED: Final = PlanBounds()


@dataclass(frozen=True, slots=True, eq=False)
class DataDrivenPlan:
    """Inputs of the horizon and what they are predicted to do; of n agents with an axis more.

    Attributes:
        u: inputs, shape (N, m).
        y: predicted outputs, shape (N, p).
        g: of DeePC, the combination of the data's windows, shape (windows,); else None.
        sigma: of DeePC, what was added to the past outputs, shape (T_ini, p); else None.
        residual: of the optimality conditions, relative to the largest term of the gradient.
    """

    u: Array
    y: Array
    g: Array | None
    sigma: Array | None
    residual: float


class DataDrivenController:
    """min Σ ‖y − r‖²_Q + ‖u − r_u‖²_R with y = G [u_ini; y_ini; u], and bounds on u and y (eq. 7).

    Args:
        predictor: of the plant, of any kind.
        weights: Q and R.
        bounds: of inputs and of predicted outputs.

    Raises:
        PredictorError: weights that are not positive, or bounds of another plant.
    """

    def __init__(
        self,
        predictor: PlantPredictor,
        weights: PlanWeights = DEFAULT_WEIGHTS,
        bounds: PlanBounds = UNBOUNDED,
    ) -> None:
        layout = predictor.layout
        self._predictor = predictor
        Q, self._R = weights.over_horizon(layout)
        self._problems = [self._build(phase, Q, bounds) for phase in range(predictor.period)]

    def plan(
        self,
        past_u: ArrayLike,
        past_y: ArrayLike,
        reference: ArrayLike,
        input_reference: ArrayLike | None = None,
        phase: int = 0,
    ) -> DataDrivenPlan:
        """The best inputs of the horizon.

        Args:
            past_u: the last T_ini inputs, oldest first, shape (T_ini, m), or (T_ini, n, m).
            past_y: the outputs that belong to them, shape (T_ini, p), or (T_ini, n, p).
            reference: r, of the outputs, shape (N, p), or (p,) for the whole horizon; of n agents
                (N, n, p) or (n, p).
            input_reference: r_u, likewise of the inputs; zero if left out.
            phase: time index of the horizon's first sample, of a periodic plant.

        Raises:
            PredictorError: another shape, numbers that are not finite, or bounds that nothing
                keeps.
        """
        layout, single = self._predictor.layout, self._predictor.single
        given = _Asked.of(layout, (past_u, past_y), reference, input_reference, single=single)
        G_past, problem = self._problems[phase % self._predictor.period]
        past = [part.reshape(layout.agents, -1) for part in (given.u_ini, given.y_ini)]
        free = G_past @ np.concatenate(past, axis=1).ravel()
        f = problem.gradient @ (free - given.reference) - self._R * given.input_reference
        u, y, residual = problem.solve(f, free)
        planned = _signal(u, layout, layout.u_scale, single=single)
        return DataDrivenPlan(
            planned, _signal(y, layout, layout.y_scale, single=single), None, None, residual
        )

    def _build(self, phase: int, Q: Array, bounds: PlanBounds) -> tuple[Array, _Problem]:
        """Of one phase, scaled: the columns of G that multiply the past, and the problem in u."""
        layout = self._predictor.layout
        G = scaled_blocks(self._predictor.blocks[phase], layout)
        whole = G.transpose(0, 2, 1, 3)  # agent, its outputs, agent, its columns
        rows = layout.agents * layout.rows
        G_past = np.ascontiguousarray(whole[..., : layout.past]).reshape(rows, -1)
        G_u = np.ascontiguousarray(whole[..., layout.past :]).reshape(rows, -1)
        gradient = G_u.T * Q
        H = gradient @ G_u
        H.flat[:: len(H) + 1] += self._R
        return G_past, _Problem(G_u, gradient, H, layout, bounds)


class Deepc:
    """min Σ ‖y − r‖²_Q + ‖u − r_u‖²_R + λ_g ‖g‖² + λ_σ ‖σ‖², with bounds on u and y (eq. 5).

    Subject to [U_p; Y_p; U_f; Y_f] g = [u_ini; y_ini + σ; u; y]. The problem is solved in u and z
    of the data's `Reduction`, as many as it has directions, instead of the g of all windows: g has
    no part outside the span of the data's rows, so this is exact, bounds on outputs included.

    Args:
        data: of the plant; episodes shorter than past + horizon are ignored.
        past: T_ini, samples that tell the plant's state.
        horizon: N, samples to plan.
        weights: with a small `lambda_g`, g chooses freely among what noisy data allow, and the
            prediction is drawn towards the reference.
        bounds: of inputs and of predicted outputs.

    Raises:
        PredictorError: too little data, inputs that do not excite, or weights that are not
            positive.
    """

    def __init__(
        self,
        data: Data,
        past: int,
        horizon: int,
        weights: PlanWeights = DEFAULT_WEIGHTS,
        bounds: PlanBounds = UNBOUNDED,
    ) -> None:
        layout = data.layout(past, horizon)
        data.check_excitation(past + horizon)
        signals = data.scaled(layout)
        reduction = reduce_signals(signals, layout)
        self._layout, self._single = layout, data.single
        n = layout.agents
        past_u, self._past_y = n * layout.inputs * past, n * layout.outputs * past
        self._by_past = reduction.response[:, :past_u]
        by_x = np.hstack([reduction.response[:, past_u:], reduction.spread])
        Q, self._R = weights.over_horizon(layout)
        on_sigma = np.tile(weights.lambda_sigma * np.array(layout.y_scale) ** 2, n * past)
        effort = weights.lambda_g * reduction.inverse[past_u:]
        self._effort_past, k = effort[:, :past_u], len(effort)
        gradient = by_x.T * np.concatenate([on_sigma, Q])
        H = gradient @ by_x
        H[:k, :k] += effort[:, past_u:]
        H.flat[:: len(H) + 1] += np.concatenate([self._R, np.full(len(H) - k, weights.lambda_g)])
        self._problem = _Problem(by_x, gradient, H, layout, bounds)
        self._g_by_a, self._g_by_z = _combinations(signals, reduction)

    def plan(
        self,
        past_u: ArrayLike,
        past_y: ArrayLike,
        reference: ArrayLike,
        input_reference: ArrayLike | None = None,
    ) -> DataDrivenPlan:
        """The best inputs of the horizon; see `DataDrivenController.plan`."""
        layout, single = self._layout, self._single
        given = _Asked.of(layout, (past_u, past_y), reference, input_reference, single=single)
        past_part = self._by_past @ given.u_ini
        f = self._problem.gradient @ (past_part - np.concatenate([given.y_ini, given.reference]))
        k = len(self._R)
        f[:k] += self._effort_past @ given.u_ini - self._R * given.input_reference
        x, outputs, residual = self._problem.solve(f, past_part)
        u = x[:k]
        sigma = outputs[: self._past_y] - given.y_ini
        g = self._g_by_a @ np.concatenate([given.u_ini, u]) + self._g_by_z @ x[k:]
        y = outputs[self._past_y :]
        return DataDrivenPlan(
            _signal(u, layout, layout.u_scale, single=single),
            _signal(y, layout, layout.y_scale, single=single),
            g,
            _signal(sigma, layout, layout.y_scale, single=single),
            residual,
        )


def _combinations(signals: list[Array], reduction: Reduction) -> tuple[Array, Array]:
    """Maps from [u_ini; u] and from z to g, which is their sum.

    With H_a and H_b the Hankel matrices of inputs and outputs, g = H_aᵀ S_aa⁻¹ a + Rᵀ M (MᵀM)⁻¹ z
    with R = H_b − Φ H_a: then H_a g = a and H_b g = Φ a + M z, and no g is shorter.
    """
    L = reduction.layout.T_ini + reduction.layout.N
    H = mosaic(signals, L)
    a, b = input_output_rows(reduction.layout)
    left = H[b] - reduction.response @ H[a]
    squares = (reduction.spread**2).sum(axis=0)
    return H[a].T @ reduction.inverse, left.T @ (reduction.spread / squares)


def _signal(vector: Array, layout: Layout, scale: tuple[float, ...], *, single: bool) -> Array:
    """A scaled vector, agents stacked, as a signal in the units of the data."""
    signal: Array = unstack(vector, layout.agents, len(scale), single=single) * np.array(scale)
    return signal


class _Asked(NamedTuple):
    """What a plan is made for, scaled, each a vector with agents stacked.

    Attributes:
        u_ini: past inputs, (n m T_ini,).
        y_ini: past outputs, (n p T_ini,).
        reference: of the outputs, (n p N,).
        input_reference: of the inputs, (n m N,).
    """

    u_ini: Array
    y_ini: Array
    reference: Array
    input_reference: Array

    @classmethod
    def of(
        cls,
        layout: Layout,
        past: tuple[ArrayLike, ArrayLike],
        reference: ArrayLike,
        input_reference: ArrayLike | None,
        *,
        single: bool,
    ) -> _Asked:
        """Check and scale what a user hands in; a reference may be one sample for all.

        Raises:
            PredictorError: another shape, or numbers that are not finite.
        """
        n, m, p, T_ini, N = layout.agents, layout.inputs, layout.outputs, layout.T_ini, layout.N
        u_ini = as_signal("past_u", past[0], (T_ini, n, m), single=single)
        y_ini = as_signal("past_y", past[1], (T_ini, n, p), single=single)
        y_ref = _as_reference("reference", reference, (N, n, p), single=single)
        u_ref = np.zeros((N, n, m))
        if input_reference is not None:
            u_ref = _as_reference("input_reference", input_reference, (N, n, m), single=single)
        u_scale, y_scale = np.array(layout.u_scale), np.array(layout.y_scale)
        scaled = u_ini / u_scale, y_ini / y_scale, y_ref / y_scale, u_ref / u_scale
        return cls(*(signal.transpose(1, 0, 2).ravel() for signal in scaled))


def _as_reference(name: str, values: ArrayLike, shape: tuple[int, ...], *, single: bool) -> Array:
    """A reference over the horizon, (N, n, dim), which may be given as one sample for all of it.

    Raises:
        PredictorError: another shape, or numbers that are not finite.
    """
    array = as_numbers(name, values)
    if array.shape == (shape[2:] if single else shape[1:]):
        return np.broadcast_to(array.reshape(shape[1:]), shape)
    return as_signal(name, array, shape, single=single)


class _Problem:
    """A QP in the inputs of the horizon and what else is free, with the outputs that come of it.

    Args:
        by_x: effect of x on the outputs, (rows, k); the last n p N rows are those of the horizon,
            the first n m N unknowns its inputs.
        gradient: by_xᵀ times the weights of the outputs.
        H: Hessian, (k, k).
        layout: of the plant.
        bounds: of inputs and outputs.
    """

    def __init__(
        self, by_x: Array, gradient: Array, H: Array, layout: Layout, bounds: PlanBounds
    ) -> None:
        u_low, u_high = bounds.over_horizon(layout, "u")
        y_low, y_high = bounds.over_horizon(layout, "y")
        bounded = np.flatnonzero(np.isfinite(y_low) | np.isfinite(y_high))
        free = np.full(len(H) - len(u_low), np.inf)
        self.gradient, self._by_x = gradient, by_x
        self._rows = len(by_x) - len(y_low) + bounded
        self._lower = np.concatenate([u_low, -free, y_low[bounded]])
        self._upper = np.concatenate([u_high, free, y_high[bounded]])
        self._qp = BoundedQp(H, by_x[self._rows])

    def solve(self, f: Array, free: Array) -> tuple[Array, Array, float]:
        """The best x for a linear term, the outputs with their free part, and the residual."""
        shift = np.concatenate([np.zeros(len(f)), free[self._rows]])
        x, residual = self._qp.solve(f, self._lower - shift, self._upper - shift)
        return x, free + self._by_x @ x, residual


class BoundedQp:
    """min ½ xᵀ H x + fᵀ x,  lower ≤ [x; A x] ≤ upper: dense, set up once for many linear terms.

    The closed form while no bound is active, else DAQP's dual active-set method, which is exact.
    Every solve starts afresh, so that equal problems have equal answers.

    Args:
        H: positive definite, shape (k, k).
        A: shape (rows, k); may have no rows.

    Raises:
        PredictorError: H is not positive definite.
    """

    def __init__(self, H: Array, A: Array) -> None:
        self._H, self._A = np.ascontiguousarray(0.5 * (H + H.T)), np.ascontiguousarray(A)
        try:
            self._factor = linalg.cho_factor(self._H, lower=True)
        except linalg.LinAlgError:
            raise PredictorError(
                "weights", "a problem without a least cost", "a positive definite one", _APART
            ) from None
        count = len(H) + len(A)
        self._cold = np.zeros(count, dtype=np.int32)
        self._model = daqp.Model()
        self._model.settings = {"primal_tol": 1e-9}
        free = np.full(count, _FAR)
        self._model.setup(self._H, np.zeros(len(H)), self._A, free, -free, self._cold)

    def solve(self, f: Array, lower: Array, upper: Array) -> tuple[Array, float]:
        """The minimiser, and the larger of its residual and of what it exceeds a bound by.

        Args:
            f: shape (k,).
            lower: bounds of [x; A x] from below, shape (k + rows,).
            upper: from above.

        Raises:
            PredictorError: nothing keeps to the bounds, or the solver failed.
        """
        x = -linalg.cho_solve(self._factor, f, check_finite=False)
        values = np.concatenate([x, self._A @ x])
        if (values >= lower).all() and (values <= upper).all():
            return x, self._residual(f, x, np.zeros(len(values)))
        self._model.update(
            f=f, sense=self._cold, bupper=np.minimum(upper, _FAR), blower=np.maximum(lower, -_FAR)
        )
        x, _, flag, info = self._model.solve()
        if flag != 1:
            raise PredictorError(
                "plan",
                f"no solution ({_STATUS.get(flag, 'the solver failed')})",
                "bounds that some inputs keep",
                "outputs that cannot get between their bounds?",
            )
        values = np.concatenate([x, self._A @ x])
        violation = float(np.maximum(values - upper, lower - values).max())
        residual = max(self._residual(f, x, info["lam"]), violation)
        if not residual <= _MAX_RESIDUAL:
            raise PredictorError(
                "plan", f"a residual of {residual:.1e}", f"at most {_MAX_RESIDUAL:g}", _APART
            )
        return x, residual

    def _residual(self, f: Array, x: Array, multipliers: Array) -> float:
        """‖H x + f + λ_x + Aᵀ λ_A‖∞ over the largest of its terms."""
        Hx = self._H @ x
        pull = multipliers[: len(x)] + self._A.T @ multipliers[len(x) :]
        scale = max(float(np.abs(term).max()) for term in (Hx, f, pull))
        return float(np.abs(Hx + f + pull).max()) / scale if scale > 0.0 else 0.0
