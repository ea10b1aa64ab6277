"""Predictors that are loaded: none of another team, none beyond a gate's limit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from quadriga.agents.planner import qp
from quadriga.agents.planner.acceptance import load_checked
from quadriga.agents.planner.qp import Condensed
from quadriga.agents.predictor.predictor import Predictor
from quadriga.agents.predictor.store import Provenance
from quadriga.shared.config.sections import Config, PlannerConfig
from quadriga.shared.errors import PredictorError
from quadriga.shared.robots.conventions import Array


def test_what_is_saved_is_loaded(
    stored: Path, plant: Config, fitted: tuple[Predictor, Provenance]
) -> None:
    predictor, provenance = load_checked(stored, plant)
    assert predictor.G.tobytes() == fitted[0].G.tobytes()
    assert predictor.meta == fitted[0].meta
    assert provenance == fitted[1]


def test_a_missing_file_tells_how_to_get_one(tmp_path: Path, plant: Config) -> None:
    with pytest.raises(PredictorError, match=r"got no such file.*`quadriga fit`"):
        load_checked(tmp_path / "none.npz", plant)


@pytest.mark.parametrize(
    ("section", "changes", "message"),
    [
        ("team", {"robots": 3}, "robots: got 2, expected 3 as configured"),
        ("team", {"yokes": "chain"}, "yokes: got 'complete', expected 'chain'"),
        ("team", {"alternate_phase": False}, "alternate_phase: got True, expected False"),
        ("gait", {"stance_ms": 150}, "stance_ms: got 200, expected 150"),
        ("planner", {"N": 20}, "N: got 8, expected 20"),
        ("planner", {"T_ini": 12}, "T_ini: got 4, expected 12"),
        ("planner", {"interface": "force"}, "interface: got 'feedforward', expected 'force'"),
        ("controller", {"kp_z": 100.0}, r"controller\.kp_z: got 400\.0, expected 100\.0"),
    ],
)
def test_a_foreign_predictor_is_refused_by_name(
    stored: Path, plant: Config, section: str, changes: dict[str, Any], message: str
) -> None:
    foreign = replace(plant, **{section: replace(getattr(plant, section), **changes)})
    with pytest.raises(PredictorError, match=f"{message}.*`quadriga fit`"):
        load_checked(stored, foreign)


def test_what_does_not_touch_the_plant_may_differ(stored: Path, plant: Config) -> None:
    other = replace(
        plant,
        controller=replace(plant.controller, damping=3.0),
        world=replace(plant.world, seed=7, terrain="boxes"),
    )
    load_checked(stored, other)


def test_gates_hold_against_the_limits_in_force(stored: Path, plant: Config) -> None:
    strict = replace(plant.identification, gain_range=(1.5, 2.0))
    with pytest.raises(PredictorError, match="height gain of r1"):
        load_checked(stored, replace(plant, identification=strict))


def test_other_weights_are_gated_anew(stored: Path, plant: Config) -> None:
    """The radius belongs to the QP; with forces made cheap the plans fight harder."""
    before = load_checked(stored, plant)[1].gates.radius
    cheap = replace(plant, planner=replace(plant.planner, R=(1e-7, 1e-7, 1e-7)))
    loose = replace(plant.identification, max_radius=10.0)
    after = load_checked(stored, replace(cheap, identification=loose))[1].gates
    assert after.radius > 2 * before
    assert after.R == (1e-7, 1e-7, 1e-7)
    between = replace(plant.identification, max_radius=0.5 * (before + after.radius))
    load_checked(stored, replace(plant, identification=between))
    with pytest.raises(PredictorError, match="radius of the best-response map"):
        load_checked(stored, replace(cheap, identification=between))


def test_a_new_key_of_the_cost_is_gated_anew(
    stored: Path, plant: Config, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As if `force_min` weighed the differences between successive forces: no list names it."""
    condense = qp.condense

    def smoothing(
        config: PlannerConfig, G_past: Array, G_u: Array, stance: NDArray[np.bool_]
    ) -> Condensed:
        usual = condense(config, G_past, G_u, stance)
        steps = np.diff(np.eye(len(usual.H)), axis=0)
        return replace(usual, H=usual.H + config.force_min * steps.T @ steps)

    before = load_checked(stored, plant)[1].gates
    monkeypatch.setattr(qp, "condense", smoothing)
    assert load_checked(stored, plant)[1].gates == before, "its default changes no QP"
    smooth = replace(plant, planner=replace(plant.planner, force_min=5.0))
    after = load_checked(stored, smooth)[1].gates
    assert after.radius < 0.9 * before.radius
    assert (after.Q, after.R) == (before.Q, before.R)
    alone = replace(smooth, planner=replace(smooth.planner, kind="decentralised"))
    assert load_checked(stored, alone)[1].gates == before, "nobody answers anybody's plans"
