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

    Block (t, s) of G_ij at phase θ, which maps the inputs of sample s to the outputs of sample t,
    is h_{t−s}(θ + s δ) B for t ≥ s and zero before: no input acts backwards. B takes inputs to net
    wrenches; δ is what the phase advances in a sample.

    Attributes:
        response: coefficients of h, what a wrench of a sample does l samples later, as polynomials
            of the phase, (2d + 2, N, n pushing, w, n responding, p).
        free: harmonics of the map from [w_ini; y_ini] to the outputs of the horizon,
            (2q + 1, n responding, n, p N, (w + p) T_ini).
        wrench: from the inputs to what they act by, from the forces of four feet to their net
            wrench, (w, m).
    """

    response: Array
    free: Array
    wrench: Array

    def __post_init__(self) -> None:
        for name in FACTORS:
            getattr(self, name).setflags(write=False)

    def block(self, i: int, j: int, phase: int, phases: int) -> Array:
        """G_ij of one of `phases` equal parts of the period. Shape (p N, (m + p) T_ini + m N)."""
        past = self._past_block(i, j, phase, phases)
        return np.concatenate([past, self.future_block(i, j, phase, phases)], axis=1)

    def future_block(self, i: int, j: int, phase: int, phases: int) -> Array:
        """The columns of G_ij that multiply the future inputs. Shape (p N, m N)."""
        response = self.response[:, :, j, :, i]
        _, N, _, outputs = response.shape
        angle = 2.0 * np.pi * (phase + np.arange(N)) / phases
        h = np.tensordot(polynomials(angle, len(response) // 2 - 1), response, axes=1)
        by_input = np.einsum("slwo,wu->slou", h, self.wrench)
        block = np.zeros((N, outputs, N, self.wrench.shape[1]))
        for s in range(N):
            block[s:, :, s] = by_input[s, : N - s]
        return block.reshape(N * outputs, -1)

    def _past_block(self, i: int, j: int, phase: int, phases: int) -> Array:
        """The columns of G_ij that multiply [u_ini; y_ini]. Shape (p N, (m + p) T_ini)."""
        free, components = self.free[:, i, j], len(self.wrench)
        T_ini = free.shape[2] // (components + self.response.shape[5])
        angle = np.array(2.0 * np.pi * phase / phases)
        past = np.tensordot(harmonics(angle, len(free) // 2), free, axes=1)
        on_w = past[:, : components * T_ini].reshape(-1, T_ini, components) @ self.wrench
        return np.concatenate([on_w.reshape(len(past), -1), past[:, components * T_ini :]], axis=1)


class PeriodicPredictor(Predictor):
    """A predictor whose blocks are expanded when they are asked for, see `PeriodicFactors`.

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
        return self.factors.block(i, j, phase, self.phases)

    def future_block(self, i: int, j: int, phase: int = 0) -> Array:
        """See `Predictor.future_block`."""
        return self.factors.future_block(i, j, phase, self.phases)
