"""A robot that walks exactly as commanded beside a peer that does nothing, with changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from quadriga.agents.planner.peers import PeerData, Peers, PeerTerms
from quadriga.agents.planner.planner import Planner, PlannerInputs, PlannerState, PlanResult
from quadriga.agents.predictor.predictor import Predictor
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import Array
from tests.a1 import WEIGHT, nominal_forces

Team = Callable[..., Any]
BASE = np.array([0.26, 0.4, 0.0, 0.0, 0.0, 0.1])
STEP = 20
NOTHING = PeerTerms()


def peer(config: Config, **changes: Any) -> PeerData:
    """A peer that did and plans nothing, with changes."""
    quiet = PeerData(
        robot="r2",
        index=1,
        status="usable",
        step=STEP - 1,
        age=0,
        known=np.ones(config.planner.T_ini, dtype=np.bool_),
        du_ini=np.zeros((config.planner.T_ini, 12)),
        y_ini=np.tile(BASE, (config.planner.T_ini, 1)),
        du=np.zeros((config.planner.N, 12)),
    )
    return replace(quiet, **changes)


def inputs_of(config: Config, step: int = STEP, **changes: Any) -> PlannerInputs:
    """A robot that walks exactly as commanded, with changes."""
    planner = config.planner
    stance = np.ones((planner.T_ini, 4), dtype=np.bool_)
    calm = PlannerInputs(
        step=step,
        u_ini=nominal_forces(stance),
        y_ini=np.tile(BASE, (planner.T_ini, 1)),
        stance_ini=stance,
        y_base_ini=np.tile(BASE, (planner.T_ini, 1)),
        y_base=np.tile(BASE, (planner.N, 1)),
        y_des=np.tile(BASE, (planner.N, 1)),
        weight=WEIGHT,
    )
    return replace(calm, **changes)


def terms_of(
    config: Config, predictor: Predictor, *peers: PeerData, base: Array | None = None
) -> PeerTerms:
    """Terms of the peers given, by default of one that did and plans nothing."""
    y_base = np.tile(BASE, (config.planner.T_ini, 1)) if base is None else base
    return Peers(config, 0, predictor).terms(peers or (peer(config),), STEP, 0, y_base)


def plan(
    config: Config,
    predictor: Predictor,
    inputs: PlannerInputs,
    *peers: PeerData,
    base: Array | None = None,
) -> PlanResult:
    planner = Planner(config, 0, predictor)
    terms = terms_of(config, predictor, *peers, base=base)
    return planner.step(PlannerState(), inputs, terms)[1]


def team_cost(
    config: Config, predictor: Predictor, inputs: list[PlannerInputs], du: Array
) -> float:
    """Eq. 7 written out: tracking of all robots and effort. du of shape (n, N, 12)."""
    z = np.stack([np.concatenate([r.past(), f.ravel()]) for r, f in zip(inputs, du, strict=True)])
    y = predictor.predict(z).reshape(len(inputs), -1, 6)
    total = 0.0
    for robot, predicted, forces in zip(inputs, y, du, strict=True):
        error = robot.y_base + predicted - robot.y_des
        total += float((error**2 @ config.planner.Q).sum())
        total += float((forces.reshape(-1, 4, 3) ** 2 @ config.planner.R).sum())
    return total
