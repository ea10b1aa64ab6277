"""G as a function of the gait's phase: coefficients of responses, expanded block by block."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from quadriga.agents.predictor.periodic_basis import N_WRENCH, harmonics, polynomials
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.shared.errors import PredictorError
from quadriga.shared.robot.conventions import N_FORCES, N_OUTPUTS, Array

FACTORS: Final = ("response", "free", "wrench")  # arrays of a periodic predictor


@dataclass(frozen=True, slots=True)
class PeriodicFactors:
    """What a periodic G is made of, in physical units but for the wrenches' scale.

    Attributes:
        response: coefficients of h, what a wrench of a sample does l samples later, as polynomials
            of the phase, (2d + 2, N, n pushing, 6, n responding, 6).
        free: harmonics of the map from [w_ini; y_ini] to the outputs of the horizon,
            (2q + 1, n responding, n, 6 N, 12 T_ini).
        wrench: from the forces of four feet to their net wrench, (6, 12).
    """

    response: Array
    free: Array
    wrench: Array

    def __post_init__(self) -> None:
        for name in FACTORS:
            getattr(self, name).setflags(write=False)


class PeriodicPredictor(Predictor):
    """A predictor whose blocks are expanded when they are asked for.

    Block (t, s) of G_ij at phase θ, which maps the forces of sample s to the outputs of sample t,
    is h_{t−s}(θ + s δ) B for t ≥ s and zero before: no force acts backwards. B takes forces to net
    wrenches; δ is what the phase advances in a sample.

    Args:
        meta: what it was fitted for.
        factors: what G is made of.
        condition: number of the regression it was fitted by; None: unknown.

    Raises:
        PredictorError: arrays of other shapes.
    """

    __slots__ = ("factors",)
    factors: PeriodicFactors

    def __init__(
        self, meta: PredictorMeta, factors: PeriodicFactors, condition: float | None = None
    ) -> None:
        n, N = meta.robots, meta.N
        ends = {
            "response": (N, n, N_WRENCH, n, N_OUTPUTS),
            "free": (n, n, N_OUTPUTS * N, (N_WRENCH + N_OUTPUTS) * meta.T_ini),
            "wrench": (N_FORCES,),
        }
        for name, end in ends.items():
            shape = getattr(factors, name).shape
            if shape[1:] != end:
                raise PredictorError(f"predictor.{name}", f"shape {shape}", f"(…, {end})")
        for name, value in (("meta", meta), ("factors", factors), ("condition", condition)):
            object.__setattr__(self, name, value)

    def __reduce__(self) -> tuple[type[PeriodicPredictor], tuple[object, ...]]:
        """Pickled by what it is made of: a data class would pickle G too, and could not set it."""
        return PeriodicPredictor, (self.meta, self.factors, self.condition)

    @property
    def G(self) -> Array:
        """All blocks at once, (P, n, n, 6 N, W): large; meant for small teams and for tests."""
        robots, phases = range(self.meta.robots), range(self.phases)
        return np.array([[[self.block(i, j, p) for j in robots] for i in robots] for p in phases])

    @property
    def nbytes(self) -> int:
        """Memory of the factors."""
        return sum(array.nbytes for array in self.arrays().values())

    def arrays(self) -> Mapping[str, Array]:
        """The factors, by name."""
        return {name: getattr(self.factors, name) for name in FACTORS}

    def couples(self, i: int, j: int) -> bool:
        """Whether anything that robot j does has an effect on robot i."""
        response, free = self.factors.response, self.factors.free
        return bool(response[:, :, j, :, i].any() or free[:, i, j].any())

    def block(self, i: int, j: int, phase: int = 0) -> Array:
        """See `Predictor.block`."""
        past = self._past_block(i, j, phase)
        return np.concatenate([past, self.future_block(i, j, phase)], axis=1)

    def future_block(self, i: int, j: int, phase: int = 0) -> Array:
        """See `Predictor.future_block`."""
        N, response = self.meta.N, self.factors.response[:, :, j, :, i]
        angle = 2.0 * np.pi * (phase + np.arange(N)) / self.phases
        h = np.tensordot(polynomials(angle, len(response) // 2 - 1), response, axes=1)
        by_force = np.einsum("slwo,wu->slou", h, self.factors.wrench)
        block = np.zeros((N, N_OUTPUTS, N, N_FORCES))
        for s in range(N):
            block[s:, :, s] = by_force[s, : N - s]
        return block.reshape(N * N_OUTPUTS, N * N_FORCES)

    def _past_block(self, i: int, j: int, phase: int) -> Array:
        """The columns of G_ij that multiply [u_ini; y_ini]. Shape (6 N, 18 T_ini)."""
        T_ini, free = self.meta.T_ini, self.factors.free[:, i, j]
        angle = np.array(2.0 * np.pi * phase / self.phases)
        past = np.tensordot(harmonics(angle, len(free) // 2), free, axes=1)
        on_w = past[:, : N_WRENCH * T_ini].reshape(-1, T_ini, N_WRENCH) @ self.factors.wrench
        return np.concatenate([on_w.reshape(len(past), -1), past[:, N_WRENCH * T_ini :]], axis=1)
