"""Correction of one robot's row of G from new windows: recursive least squares with forgetting.

It forgets only along the directions that new windows excite (Kulhavý's directional forgetting).
With plain exponential forgetting a team that stands or trots evenly would forget all that it does
not excite, and its covariance would grow as λ^−k.

A change of the plant, such as an unknown load, shows in the prediction error. That error is
regressed on the robot's own [u_ini; y_ini; u], which corrects G_ii. The same correction serves
every phase. All numbers are scaled deviations, so that one prior fits all.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from quadriga.agents.predictor.layout import Layout, scales
from quadriga.agents.predictor.predictor import Predictor
from quadriga.shared.errors import PredictorError
from quadriga.shared.robot.conventions import Array

_LARGEST = 100.0  # of an entry of D; the largest ones of a predictor, as scaled, are about 1
_NOTHING = 1e-12  # zᵀPz of a regressor that says nothing about anything not known


@dataclass(frozen=True, slots=True)
class Forgetting:
    """How the recursion weighs old windows against new ones.

    Attributes:
        factor: λ, share of the older information on its own direction that a window keeps; 1: all.
        prior: variance of an entry of the correction before the first window.
        bound: largest mean variance; nothing is forgotten where the variance would exceed it.
    """

    factor: float = 0.999
    prior: float = 1e-3
    bound: float = 1e-2

    def __post_init__(self) -> None:
        if not 0.0 < self.factor <= 1.0:
            raise PredictorError("forgetting.factor", f"{self.factor:g}", "above 0, at most 1")
        if not 0.0 < self.prior <= self.bound:
            raise PredictorError(
                "forgetting.prior", f"{self.prior:g}", f"above 0, at most the bound {self.bound:g}"
            )


@dataclass(frozen=True, slots=True)
class Correction:
    """The estimate so far of the difference between one robot's row of G and the predictor's.

    Attributes:
        robot: i, whose row it is.
        D: scaled correction ΔG_ii, shape (p N, W).
        P: covariance over the noise variance, shape (W, W), exactly symmetric.
        updates: windows that were taken in.
        skipped: windows without new information.
        refused: windows that were implausible, or would have made D implausible.
    """

    robot: int
    D: Array
    P: Array
    updates: int = 0
    skipped: int = 0
    refused: int = 0

    def refuse(self) -> Correction:
        """The same correction with one more refused window."""
        return replace(self, refused=self.refused + 1)


def begin_correction(layout: Layout, robot: int, how: Forgetting) -> Correction:
    """The correction before the first window: zero.

    Raises:
        PredictorError: a robot that is not in the team.
    """
    if not 0 <= robot < layout.agents:
        raise PredictorError("robot of the correction", f"{robot}", f"0 … {layout.agents - 1}")
    D, P = np.zeros((layout.rows, layout.width)), how.prior * np.eye(layout.width)
    return Correction(robot, D, P)


def take_in(
    state: Correction, predictor: Predictor, z: Array, y: Array, phase: int, how: Forgetting
) -> Correction:
    """Take in one window that has been measured to its end.

    Args:
        state: the correction so far.
        predictor: the one that is corrected; the same one in every call.
        z: [u_ini; y_ini; u] of all robots, deviations, shape (n, 18 T_ini + 12 N), N, m, ….
        y: measured output deviations of robot i, shape (6 N,).
        phase: of the window.
        how: weights.

    Raises:
        PredictorError: another shape, or numbers that are not finite.
    """
    layout = predictor.meta.layout
    if z.shape != (layout.agents, layout.width) or y.shape != (layout.rows,):
        raise PredictorError(
            "window",
            f"shapes {z.shape}, {y.shape}",
            f"{(layout.agents, layout.width)}, {(layout.rows,)}",
        )
    if not (np.isfinite(z).all() and np.isfinite(y).all()):
        raise PredictorError("window", "NaN or infinity", "finite numbers")
    blocks = np.stack([predictor.block(state.robot, j, phase) for j in range(layout.agents)])
    left = y - np.einsum("jab,jb->a", blocks, z)
    z_scale, y_scale = scales(layout)
    return update(state, z[state.robot] / z_scale, left / y_scale, how)


def update(state: Correction, z: Array, left: Array, how: Forgetting) -> Correction:
    """One step: least squares of the new window and what is known, then forgetting along z.

    With s = zᵀPz: D ← D + (left − D z) zᵀP / (1 + s); P ← P − PzzᵀP (λ s − 1 + λ) / (λ s (1 + s)),
    which leaves zᵀPz = s / (λ (1 + s)). With λ = 1 that is batch least squares,
    min Σ ‖left − D z‖² + ‖D‖² / prior; with one direction alone, exponentially weighted. Under a
    constant z the variance along it settles at (1 − λ) / λ and no other direction is touched.

    A window is refused if after it an entry of D would be no finite number or far beyond any plant,
    since every later plan would then be implausible too.

    Args:
        state: the correction so far.
        z: scaled regressor, shape (k,).
        left: scaled outputs that the predictor does not explain, shape (6 N,).
        how: weights.
    """
    Pz = state.P @ z
    s = float(z @ Pz)
    if s <= _NOTHING:
        return replace(state, skipped=state.skipped + 1)
    lost, size = (how.factor * s - 1.0 + how.factor) / (how.factor * s * (1.0 + s)), float(Pz @ Pz)
    if state.P.trace() - lost * size > how.bound * len(Pz):
        lost = 1.0 / (1.0 + s)
    D = state.D + np.outer(left - state.D @ z, Pz / (1.0 + s))
    if not (np.abs(D).max() <= _LARGEST and math.isfinite(lost * size)):
        return state.refuse()
    P = state.P - lost * np.outer(Pz, Pz)
    return replace(state, D=D, P=P, updates=state.updates + 1)


def block_correction(layout: Layout, state: Correction) -> Array:
    """The correction's addition to G_ii, in physical units. Shape (6 N, 18 T_ini + 12 N)."""
    z_scale, y_scale = scales(layout)
    added: Array = state.D * y_scale[:, None] / z_scale
    return added
