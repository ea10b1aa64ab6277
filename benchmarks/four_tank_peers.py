"""The four-tank example as users of two other packages write it.

`pip install direct-data-driven-mpc` and PyDeePC's repository make them available; they are no
dependencies of the project. Where one gives less than is compared, its attributes are read.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib.util import find_spec
from types import MappingProxyType
from typing import Any, Final, Protocol

import numpy as np

from quadriga.agents.predictor.four_tank import FourTank
from quadriga.shared.robots.conventions import Array

_TOLERANCES: Final = (1e-13, 1e-11, 1e-9)
_EXACT: Final = 1e4  # weight of a slack's 1-norm with which no slack is used, without noise


class NoAnswer(Exception):
    """Clarabel failed, whatever its tolerance."""


def solve_tightly(solve: Callable[..., Any]) -> Any:
    """Call a function that solves by CVXPY, with the tightest tolerance that Clarabel reaches.

    Args:
        solve: takes the settings of the solver.

    Raises:
        NoAnswer: with its usual tolerance it fails too.
    """
    from cvxpy.error import SolverError

    for tolerance in _TOLERANCES:
        settings = dict.fromkeys(("tol_gap_abs", "tol_gap_rel", "tol_feas"), tolerance)
        try:
            return solve(solver="CLARABEL", max_iter=500, **settings)
        except SolverError:
            pass
    try:
        return solve(solver="CLARABEL")
    except SolverError as error:
        raise NoAnswer(str(error)) from None


class TankPlanner(Protocol):
    """Plans the four-tank example."""

    def plan(self, past_u: Array, past_y: Array) -> tuple[Array, Array]:
        """Inputs and predicted outputs of the horizon, (N, 2) each, as a user would get them."""
        ...


class DirectPeer:
    """direct-data-driven-mpc: the nominal controller, or its robust one for data with noise.

    Args:
        example: with its data.
        noise: that the robust controller is told of; 0: the nominal one.
    """

    def __init__(self, example: FourTank, noise: float = 0.0) -> None:
        import direct_data_driven_mpc as other

        N, weights = example.horizon, example.weights
        robust = {
            "controller_type": other.LTIDataDrivenMPCType.ROBUST,
            "slack_var_constraint_type": other.SlackVarConstraintType.NONE,
            "eps_max": noise,
            "lamb_alpha": weights.lambda_g / noise if noise else 0.0,
            "lamb_sigma": weights.lambda_sigma,
            "c": 1.0,
        }
        self._controller = other.LTIDataDrivenMPCController(
            n=example.past,
            m=2,
            p=2,
            u_d=example.data.u[0][:, 0],
            y_d=example.data.y[0][:, 0],
            L=N,
            Q=float(np.asarray(weights.Q)) * np.eye(2 * N),
            R=float(np.asarray(weights.R)) * np.eye(2 * N),
            u_s=example.input_reference[:, None],
            y_s=example.reference[:, None],
            use_terminal_constraints=noise > 0.0,
            **(robust if noise else {}),
        )

    def plan(self, past_u: Array, past_y: Array) -> tuple[Array, Array]:
        """See `TankPlanner`."""
        self._controller.set_past_input_output_data(past_u.reshape(-1, 1), past_y.reshape(-1, 1))
        self._controller.update_and_solve_data_driven_mpc()
        return self._answer(past_u)

    def plan_tightly(self, past_u: Array, past_y: Array) -> tuple[Array, Array]:
        """The same with a tight tolerance of its solver."""
        controller = self._controller
        controller.set_past_input_output_data(past_u.reshape(-1, 1), past_y.reshape(-1, 1))
        controller._update_optimization_parameters()
        solve_tightly(controller._problem.solve)
        return self._answer(past_u)

    def _answer(self, past_u: Array) -> tuple[Array, Array]:
        inputs, outputs = self._controller._ubar.value, self._controller._ybar.value
        count = len(past_u)
        return inputs.reshape(-1, 2)[count:], outputs.reshape(-1, 2)[count:]


class PyDeepcPeer:
    """PyDeePC, with 1-norms of g and of the slack as its users have them.

    Args:
        example: with its data.
        noise: of the data; 0: g is free, and no slack is used.
    """

    def __init__(self, example: FourTank, noise: float = 0.0) -> None:
        import cvxpy as cp
        from pydeepc import DeePC
        from pydeepc.utils import Data

        weights, self._data = example.weights, Data
        Q, R = float(np.asarray(weights.Q)), float(np.asarray(weights.R))

        def loss(u: Any, y: Any) -> Any:
            return Q * cp.sum_squares(y - np.tile(example.reference, (example.horizon, 1))) + (
                R * cp.sum_squares(u - np.tile(example.input_reference, (example.horizon, 1)))
            )

        data = Data(u=example.data.u[0][:, 0], y=example.data.y[0][:, 0])
        self._deepc = DeePC(data, Tini=example.past, horizon=example.horizon)
        self._deepc.build_problem(
            build_loss=loss,
            build_constraints=lambda u, y: [u >= -100.0, u <= 100.0],  # it wants some
            lambda_g=weights.lambda_g if noise else 0.0,
            lambda_y=weights.lambda_sigma if noise else _EXACT,
            lambda_u=_EXACT,
        )

    def plan(self, past_u: Array, past_y: Array) -> tuple[Array, Array]:
        """See `TankPlanner`."""
        u, found = self._deepc.solve(data_ini=self._data(u=past_u, y=past_y))
        return u, found["variables"].y.value

    def plan_tightly(self, past_u: Array, past_y: Array) -> tuple[Array, Array]:
        """The same with a tight tolerance of its solver."""
        problem = self._deepc.optimization_problem
        variables = problem.variables
        variables.u_ini.value, variables.y_ini.value = past_u.ravel(), past_y.ravel()
        solve_tightly(problem.problem.solve)
        return variables.u.value, variables.y.value


Peer = DirectPeer | PyDeepcPeer
PEERS: Final[Mapping[str, Callable[..., Peer]]] = MappingProxyType(
    {"direct-data-driven-mpc": DirectPeer, "PyDeePC": PyDeepcPeer}
)
_MODULES: Final = MappingProxyType(
    {"direct-data-driven-mpc": "direct_data_driven_mpc", "PyDeePC": "pydeepc"}
)
HOW_TO_INSTALL: Final = MappingProxyType(
    {
        "direct-data-driven-mpc": "pip install 'quadriga[compare]'",
        "PyDeePC": "pip install git+https://github.com/rssalessio/PyDeePC, which brings Jupyter: "
        "into an environment of its own, beside quadriga",
    }
)


def is_installed(name: str) -> bool:
    """Whether a package of `PEERS` can be imported."""
    return find_spec(_MODULES[name]) is not None
