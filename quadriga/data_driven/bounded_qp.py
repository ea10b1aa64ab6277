"""A dense convex QP with bounds, set up once and solved for many linear terms."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

import daqp
import numpy as np
from scipy import linalg

from quadriga.shared.errors import PredictorError
from quadriga.shared.robot.conventions import Array

_FAR: Final = 1e30  # DAQP's infinity
_STATUS: Final = MappingProxyType({-1: "infeasible", -2: "cycling", -4: "iteration limit"})
_MAX_RESIDUAL: Final = 1e-6  # an answer with a larger one is not used, whatever the solver says
_APART: Final = "weights that are many orders of magnitude apart"


class BoundedQp:
    """min ½ xᵀ H x + fᵀ x,  lower ≤ [x; A x] ≤ upper.

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
