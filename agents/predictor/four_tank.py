"""The linearised four-tank process, the usual first plant of data-driven control.

Two pumps feed four tanks, of which the levels of two are measured. Matrices and set-point are those
of Berberich, Köhler, Müller and Allgöwer, "Data-driven model predictive control with stability and
robustness guarantees", IEEE Transactions on Automatic Control 66 (2021), section V.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from quadriga.agents.predictor.control import PlanWeights
from quadriga.agents.predictor.plant import Data
from quadriga.shared.errors import PredictorError
from quadriga.shared.robots.conventions import Array

_A: Final = np.array(
    [
        [0.921, 0.0, 0.041, 0.0],
        [0.0, 0.918, 0.0, 0.033],
        [0.0, 0.0, 0.924, 0.0],
        [0.0, 0.0, 0.0, 0.937],
    ]
)
_B: Final = np.array([[0.017, 0.001], [0.001, 0.023], [0.0, 0.061], [0.072, 0.0]])
_C: Final = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]])
_SAMPLES: Final = 400


class LinearPlant:
    """x⁺ = A x + B u, y = C x + D u; it keeps its state from call to call.

    Args:
        A: shape (states, states).
        B: shape (states, m).
        C: shape (p, states).
        D: shape (p, m); zero if left out.

    Attributes:
        x: state, shape (states,); zero at first, may be set.
    """

    def __init__(self, A: Array, B: Array, C: Array, D: Array | None = None) -> None:
        self.A, self.B, self.C = A, B, C
        self.D = np.zeros((len(C), B.shape[1])) if D is None else D
        self.x = np.zeros(len(A))

    def respond(self, u: Array) -> Array:
        """Outputs (T, p) to inputs (T, m) from the present state, or (p,) to one sample (m,).

        Raises:
            PredictorError: inputs of another shape.
        """
        inputs = np.atleast_2d(u)
        if inputs.shape[1:] != self.B.shape[1:]:
            raise PredictorError("u", f"shape {np.shape(u)}", f"(T, {self.B.shape[1]})")
        y = np.empty((len(inputs), len(self.C)))
        for k, now in enumerate(inputs):
            y[k] = self.C @ self.x + self.D @ now
            self.x = self.A @ self.x + self.B @ now
        return y if np.ndim(u) == 2 else y[0]


@dataclass(frozen=True, slots=True, eq=False)
class FourTank:
    """The process, data of it, and what the example asks for.

    The publication weighs inputs by 1e-4 and has every plan end at rest. Levels answer such cheap
    inputs in the wrong direction first, so that plans without this end would push ever harder: here
    the weight is 1e-2.

    Attributes:
        plant: in the state after the data.
        data: random inputs between −1 and 1 and their outputs.
        reference: levels to reach, shape (2,).
        input_reference: inputs that hold them, shape (2,).
        past: T_ini, the number of states.
        horizon: N.
        weights: Q, R, λ_g and λ_σ.
    """

    plant: LinearPlant
    data: Data
    reference: Array
    input_reference: Array
    past: int
    horizon: int
    weights: PlanWeights


def four_tank(noise: float = 0.0, samples: int = _SAMPLES, seed: int = 0) -> FourTank:
    """The example: the plant with `samples` of data from it.

    Args:
        noise: largest error of a measured level, drawn evenly; 0.002 in the publication.
        samples: of the data.
        seed: of inputs and noise.
    """
    random = np.random.default_rng(seed)
    plant = LinearPlant(_A, _B, _C)
    u = random.uniform(-1.0, 1.0, (samples, _B.shape[1]))
    y = plant.respond(u)
    y = y + noise * random.uniform(-1.0, 1.0, y.shape)
    return FourTank(
        plant,
        Data(u=[u], y=[y]),
        reference=np.array([0.65, 0.77]),
        input_reference=np.array([1.0, 1.0]),
        past=len(_A),
        horizon=30,
        weights=PlanWeights(Q=3.0, R=1e-2, lambda_g=0.1, lambda_sigma=1000.0),
    )
