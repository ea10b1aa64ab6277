"""Loads a predictor and checks that it fits the team and that its figures pass the gates."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

from quadriga.agents.planner.best_response import (
    are_same_costs,
    iteration_radius,
    probe_costs,
    radius_limit,
    with_usual_costs,
)
from quadriga.agents.planner.cooperation import OWN, cost_of
from quadriga.agents.predictor.gate_report import GateReport
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.agents.predictor.store import REMEDY, Provenance, read
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorFileError
from quadriga.shared.planner_kinds import find_kind

# Fields of the meta that must be as configured, beside the controller's keys.
_MATCHED: Final = (
    "robots",
    "robot",
    "stance_ms",
    "alternate_phase",
    "yokes",
    "interface",
    "N",
    "T_ini",
)


def load_checked(path: Path, config: Config) -> tuple[Predictor, Provenance]:
    """Read a predictor and refuse any that is not for this team or has not passed its gates.

    The figures are compared with the limits of `config`. If the agents respond to each other's
    plans, and their QPs are not those that the stored radius is of, it is computed again.

    Raises:
        PredictorFileError: no such file, not a predictor, corrupt, fitted for another team, gait,
            horizon, interface or low level.
        PredictorError: a figure is beyond its gate's limit.
    """
    predictor, provenance = read(path)
    check_fitted_for(config, path, predictor)
    gates = gates_in_force(provenance.gates, config, predictor)
    gates.check(config.planner.kind)
    return predictor, replace(provenance, gates=gates)


def gates_in_force(gates: GateReport, config: Config, predictor: Predictor) -> GateReport:
    """The figures of a predictor with the limits of `config` and the radius of its QPs.

    Args:
        gates: as they are stored with the predictor.
        config: the team's configuration.
        predictor: whose figures these are.
    """
    limits = config.identification
    gates = replace(gates, gain_limits=tuple(limits.gain_range))
    if gates.peers is not None:
        gates = replace(gates, peers=replace(gates.peers, harm_limit=limits.max_peers_harm))
    if find_kind(config.planner.kind).needs_peers or gates.cost == OWN:
        gates = replace(gates, radius_limit=radius_limit(config))
    if not find_kind(config.planner.kind).needs_peers:
        return gates
    planner, probes = config.planner, probe_costs(config, predictor)
    known = gates.cost_probes
    if not known:
        known = probe_costs(with_usual_costs(config, gates.Q, gates.R), predictor)
    if are_same_costs(probes, known):
        return gates
    return replace(
        gates,
        radius=iteration_radius(config, predictor),
        cost=cost_of(config),
        Q=planner.Q,
        R=planner.R,
        cost_probes=probes,
    )


def check_fitted_for(config: Config, path: Path, predictor: Predictor) -> None:
    """Refuse a predictor of another team, gait, horizon, interface or low level.

    Args:
        config: the team's configuration.
        path: the predictor's file, for the error.
        predictor: what was read from it.

    Raises:
        PredictorFileError: it was fitted for another setting.
    """
    got, expected = predictor.meta, PredictorMeta.of(config)
    pairs = [(name, getattr(got, name), getattr(expected, name)) for name in _MATCHED]
    fitted = dict(got.controller)
    pairs += [(f"controller.{k}", fitted.get(k), wanted) for k, wanted in expected.controller]
    for name, stored, wanted in pairs:
        if stored != wanted:
            raise PredictorFileError(
                f"predictor {path}: {name}",
                repr(stored),
                f"{wanted!r} as configured",
                f"fitted for another setting; {REMEDY}",
            )
