"""Named settings of the low level: permitted values of known keys, below what a user says."""

from __future__ import annotations

from dataclasses import asdict, fields

import pytest

from shared.config import ControllerConfig
from shared.config_file import build, load
from shared.presets import CONTROLLER

KEYS = {item.name: item for item in fields(ControllerConfig)}


def test_presets_are_those_that_can_be_chosen() -> None:
    assert set(CONTROLLER) == set(KEYS["preset"].metadata["choices"])
    assert KEYS["preset"].default == "robust"
    assert not CONTROLLER["robust"]


@pytest.mark.parametrize("name", CONTROLLER)
def test_a_preset_sets_its_keys_and_leaves_the_others(name: str) -> None:
    """Going through the same checks as a user's values: names, types and ranges."""
    preset = CONTROLLER[name]
    found = asdict(load(None, {"controller.preset": name}).controller)
    expected = asdict(ControllerConfig()) | dict(preset) | {"preset": name}
    assert found == expected
    assert build({"controller": dict(preset)}).controller == ControllerConfig(**preset)
    assert "preset" not in preset


def test_an_explicit_key_wins_over_the_preset() -> None:
    found = load(None, {"controller.preset": "paper", "controller.kp_tilt": 123.0}).controller
    assert found.kp_tilt == 123.0
    assert found.kd_tilt == CONTROLLER["paper"]["kd_tilt"]


def test_the_papers_setting_is_the_plain_one() -> None:
    """Scheduled contacts, no integrators, and the paper's weights of the QP."""
    paper = load(None, {"controller.preset": "paper"}).controller
    assert not paper.contact_detection
    assert paper.ki_z == paper.ki_xy == 0.0
    assert not any((paper.tell_sides, paper.follow_fall, paper.flight))
    assert paper.tilt_length == paper.swing_weight == 1.0
    assert paper.liftoff_hold_ms == paper.give_way_ms == 0
    assert paper.swing_delay == paper.slip_speed == 0.0
    assert (paper.gamma_tau, paper.gamma_force, paper.gamma_defect) == (1e2, 1e3, 1e6)


def test_presets_cannot_be_changed() -> None:
    with pytest.raises(TypeError):
        CONTROLLER["paper"]["kp_z"] = 1.0  # type: ignore[index]
