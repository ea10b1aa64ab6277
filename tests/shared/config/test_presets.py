"""Named settings of a section: permitted values of known keys, below what a user says."""

from __future__ import annotations

from dataclasses import asdict, fields

import pytest

from quadriga.shared.config.load import load
from quadriga.shared.config.presets import PRESETS
from quadriga.shared.config.sections import Config

NAMED = [(section, name) for section, presets in PRESETS.items() for name in presets]


@pytest.mark.parametrize(("section", "name"), NAMED)
def test_a_preset_sets_its_keys_and_leaves_the_others(section: str, name: str) -> None:
    """Going through the same checks as a user's values: names, types and ranges."""
    keys = {item.name: item for item in fields(getattr(Config(), section))}
    assert set(PRESETS[section]) == set(keys["preset"].metadata["choices"])
    assert not PRESETS[section][str(keys["preset"].default)]
    expected = asdict(getattr(Config(), section)) | {**PRESETS[section][name], "preset": name}
    found = load(None, {f"{section}.preset": name})
    assert asdict(found) == asdict(Config()) | {section: expected}


def test_the_papers_planner_has_its_weights_and_nothing_that_it_does_not_name() -> None:
    """Fawcett et al., section V.B: Q, R, horizons, 40 ms; U is the friction cone alone."""
    paper = load(None, {"planner.preset": "paper", "identification.preset": "paper"})
    planner = paper.planner
    assert planner.Q == (1e6, 1e5, 1e5, 2e5, 1e5, 1e4)
    assert planner.R == (0.05, 0.05, 0.5)
    assert (planner.N, planner.T_ini, planner.applied) == (25, 10, 4)
    assert (planner.interface, planner.tracked) == ("force", "outputs")
    assert planner.output_bounds == "none"
    assert planner.latency_ms == planner.damping == planner.exchanges == 0
    assert not planner.compensation
    assert min(planner.deviation_max) > 10 * paper.robot.weight
    assert min(planner.trust_range) > 1e3
    assert paper.identification.predictor == "pinv"
