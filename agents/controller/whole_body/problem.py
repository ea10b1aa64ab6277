"""The whole-body QP (the paper's low-level controller): what it is made of and what it gives.

min  γ₁/2 |τ|² + γ₂/2 |f − f_des|² + γ₃/2 |W δ|²
s.t. ḧ(τ, f) = a_des + δ   (output dynamics: trunk and swing feet; a_des holds −K_P h − K_D ḣ)
     r̈(τ, f) = 0           (no slip of the feet in contact)
     τ_min ≤ τ ≤ τ_max,  f in the friction cone

W = diag(1, 1, 1, ℓ, ℓ, ℓ, s, s, …) says what a rad/s² of the trunk and a m/s² of a swing foot weigh
against a m/s² of the trunk (the paper: ℓ = 1 m, s = 1).

No slip makes the forces affine in the torques, f = A τ + a₀, and with them the outputs,
ḧ = B τ + b₀: twelve variables, a box and five rows per foot in contact remain.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from quadriga.shared.config.sections import ControllerConfig
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.jit import compiled
from quadriga.shared.runtime.record import record

UNCONSTRAINED: Final = "unconstrained"
CONSTRAINED: Final = "constrained"
INFEASIBLE: Final = "infeasible"


class Goal(NamedTuple):
    """What one tick asks of the QP (odometry frame).

    Attributes:
        contact: 1 for the feet that may push, (4,).
        trunk: desired linear and angular acceleration of the trunk, (6,), m/s², rad/s².
        swing: desired acceleration of the feet not in contact, (4, 3), m/s².
        force: desired contact forces f_des, (4, 3), N.
    """

    contact: Array
    trunk: Array
    swing: Array
    force: Array


class Weights(NamedTuple):
    """Parameters of the QP.

    Attributes:
        gamma_tau: γ₁.
        gamma_force: γ₂.
        gamma_defect: γ₃.
        mu: friction coefficient of the cone.
        force_min: least normal force of the cone, N.
        tilt_length: ℓ, m.
        swing_weight: s.
    """

    gamma_tau: float
    gamma_force: float
    gamma_defect: float
    mu: float
    force_min: float
    tilt_length: float = 1.0
    swing_weight: float = 1.0


N_WEIGHTS: Final = len(Weights._fields)


def qp_weights(config: ControllerConfig) -> Weights:
    """The parameters that a configuration sets."""
    return Weights(*(float(getattr(config, name)) for name in Weights._fields))


@compiled
def with_mu(weights: Weights, mu: float) -> Weights:
    """The weights with another friction coefficient."""
    return Weights(
        weights.gamma_tau,
        weights.gamma_force,
        weights.gamma_defect,
        mu,
        weights.force_min,
        weights.tilt_length,
        weights.swing_weight,
    )


class WholeBodyProblem(NamedTuple):
    """min ½ τᵀ H τ + gᵀ τ  s.t. τ_min ≤ τ ≤ τ_max, C τ ≥ c, with n_c feet in contact.

    Attributes:
        H: (12, 12).
        g: (12,).
        C: (5 n_c, 12).
        c: (5 n_c,).
        A: forces of each torque, f = A τ + a₀, (3 n_c, 12).
        a0: forces of none, (3 n_c,), N.
        B: accelerations of the outputs of each torque, (18 − 3 n_c, 12).
        defect0: defect of none, b₀ − a_des, (18 − 3 n_c,), m/s², rad/s².
        tau_min: (12,), N·m.
        tau_max: (12,), N·m.
    """

    H: Array
    g: Array
    C: Array
    c: Array
    A: Array
    a0: Array
    B: Array
    defect0: Array
    tau_min: Array
    tau_max: Array


SOLUTION_SIZE: Final = 12 + 12 + 18  # torques, forces, defect


@record
class WholeBodySolution:
    """What came of the QP and how.

    Attributes:
        x: torques (12), forces (12), defect (6 + 3 for each foot not in contact), the rest zero.
        status: "unconstrained" (closed form), "constrained" (active set) or, with no torques and
            the rest of no use, "infeasible:<solver's flag>" or "infeasible:singular".
        contact: 1 for the feet in contact, (4,).
    """

    x: Array
    status: str
    contact: Array

    @property
    def tau(self) -> Array:
        """Torques, (12,), N·m."""
        return self.x[:12]

    @property
    def force(self) -> Array:
        """Contact forces, (4, 3), N, odometry frame."""
        return self.x[12:24].reshape(4, 3)

    @property
    def defect(self) -> Array:
        """What the accelerations miss of the desired ones: δ."""
        return self.x[24 : 42 - 3 * int(np.count_nonzero(self.contact > 0.5))]

    @property
    def solved(self) -> bool:
        """Whether the torques may be used."""
        return self.status in (UNCONSTRAINED, CONSTRAINED)
