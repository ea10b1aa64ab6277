"""What a plan weighs, what it must keep to, and what comes out; for eq. 5 and 7 alike."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from quadriga.agents.predictor.layout import Layout
from quadriga.data_driven.signals import as_numbers, as_reference, as_signal, stack
from quadriga.shared.errors import PredictorError
from quadriga.shared.robot.conventions import Array


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

    def stages(self, layout: Layout) -> tuple[Array, Array]:
        """Q of each output and R of each input of an agent, shapes (p,) and (m,).

        Raises:
            PredictorError: a weight of another shape, or not positive.
        """
        Q = _components("weights.Q", self.Q, layout.outputs)
        R = _components("weights.R", self.R, layout.inputs)
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

    def inputs(self, layout: Layout) -> tuple[Array, Array]:
        """Lower and upper bounds of the inputs over the horizon, scaled, agents stacked.

        Raises:
            PredictorError: bounds of another shape, or that contradict each other.
        """
        return _over_horizon(layout, "u", self.u_min, self.u_max, layout.u_scale)

    def outputs(self, layout: Layout) -> tuple[Array, Array]:
        """The same of the outputs."""
        return _over_horizon(layout, "y", self.y_min, self.y_max, layout.y_scale)


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


class Request(NamedTuple):
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
    ) -> Request:
        """Check and scale what a user hands in; see `Deepc.plan`.

        Raises:
            PredictorError: another shape, or numbers that are not finite.
        """
        n, m, p = layout.agents, layout.inputs, layout.outputs
        T_ini, N = layout.T_ini, layout.N
        u_ini = as_signal("past_u", past[0], (T_ini, n, m), single=single)
        y_ini = as_signal("past_y", past[1], (T_ini, n, p), single=single)
        y_ref = as_reference("reference", reference, (N, n, p), single=single)
        u_ref = np.zeros((N, n, m))
        if input_reference is not None:
            u_ref = as_reference("input_reference", input_reference, (N, n, m), single=single)
        u_scale, y_scale = np.array(layout.u_scale), np.array(layout.y_scale)
        return cls(
            stack(u_ini / u_scale),
            stack(y_ini / y_scale),
            stack(y_ref / y_scale),
            stack(u_ref / u_scale),
        )


def _components(name: str, values: ArrayLike, dim: int) -> Array:
    array = as_numbers(name, values)
    if array.shape not in ((), (dim,)):
        raise PredictorError(name, f"shape {array.shape}", f"a number, or {dim} of them")
    return np.broadcast_to(array, (dim,))


def _over_horizon(
    layout: Layout, kind: str, low: ArrayLike, high: ArrayLike, scale: tuple[float, ...]
) -> tuple[Array, Array]:
    arrays = []
    for end, values in (("min", low), ("max", high)):
        array = np.asarray(values, dtype=np.float64)
        if array.shape not in ((), (len(scale),)) or np.isnan(array).any():
            raise PredictorError(
                f"bounds.{kind}_{end}", f"shape {array.shape} or NaN", f"a number, or {len(scale)}"
            )
        arrays.append(np.broadcast_to(array, (len(scale),)))
    if (arrays[0] > arrays[1]).any():
        raise PredictorError(
            f"bounds.{kind}_min", f"{arrays[0]} above {arrays[1]}", "at most the upper bound"
        )
    lower, upper = (np.tile(array / np.array(scale), layout.agents * layout.N) for array in arrays)
    return lower, upper
