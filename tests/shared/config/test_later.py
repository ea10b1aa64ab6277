"""A key that came later changes no hash while it has the value that all before was made with."""

from __future__ import annotations

from dataclasses import asdict, fields

import pytest

from quadriga.shared.config import later
from quadriga.shared.config.later import LATER_KEYS, hashed_sections, with_older_values
from quadriga.shared.config.load import build, load
from quadriga.shared.config.renamed import with_first_names
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import config_sha256


def test_every_later_key_is_a_key() -> None:
    keys = {
        f"{section.name}.{key.name}"
        for section in fields(Config)
        for key in fields(getattr(Config(), section.name))
    }
    assert LATER_KEYS.keys() <= keys


def test_a_later_key_is_left_out_while_it_has_its_first_value(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As if `world.friction` had come later; all before was walked on 0.7."""
    monkeypatch.setattr(later, "LATER_KEYS", {**LATER_KEYS, "world.friction": 0.7})
    before, other = (asdict(load(None, {"world.friction": value})) for value in (0.7, 0.3))
    assert "friction" not in hashed_sections(before)["world"]
    assert hashed_sections(other)["world"]["friction"] == 0.3
    assert hashed_sections(other)["gait"] == with_first_names(other)["gait"]
    assert hashed_sections({"world": 5}) == {"world": 5}, "no section, left to the check"


def test_so_it_changes_the_hash_only_with_another_value(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(later, "LATER_KEYS", {**LATER_KEYS, "world.friction": 0.7})
    hashes = [config_sha256(load(None, {"world.friction": value})) for value in (0.7, 0.3, 0.4)]
    monkeypatch.undo()
    assert len(set(hashes)) == 3
    assert hashes[1:] == [config_sha256(load(None, {"world.friction": v})) for v in (0.3, 0.4)]


def test_a_section_of_later_keys_alone_is_left_out_while_all_have_their_first_values() -> None:
    ideal = asdict(load(None, {"motors.preset": "ideal"}))
    assert "motors" not in hashed_sections(ideal)
    assert hashed_sections(asdict(Config()))["motors"]["friction"] == Config().motors.friction
    assert hashed_sections({"motors": {}}) == {"motors": {}}, "left to the check"


def test_what_an_earlier_version_wrote_down_says_nothing_of_later_keys() -> None:
    written = {"world": {"seed": 3}, "team": {"robots": 2, "robot": "go1"}, "bus": 5}
    read = with_older_values(written)
    assert read["world"] | {"seed": 3, "leg_collisions": False} == read["world"]
    assert read["team"]["robot"] == "go1"
    assert read["motors"] == asdict(load(None, {"motors.preset": "ideal"}))["motors"]
    assert read["bus"] == 5
    assert written["world"] == {"seed": 3}


def test_what_was_written_before_a_key_came_has_its_first_value() -> None:
    """Whole sections may have come later too; what is written wins, and no section stays none."""
    older = with_older_values({"sensors": {"gyro": 0.5, "yaw_drift": 0.1}, "world": 5})
    config = build({name: keys for name, keys in older.items() if isinstance(keys, dict)})
    assert (config.sensors.gyro, config.sensors.yaw_drift) == (0.5, 0.1)
    assert config.sensors.foot_sensor == LATER_KEYS["sensors.foot_sensor"]
    assert config.controller.foot_load == LATER_KEYS["controller.foot_load"]
    assert older["world"] == 5


def test_what_was_written_in_full_is_read_as_it_is() -> None:
    config = load(None, {"sensors.preset": "realistic", "controller.foot_load": "fused"})
    assert build(with_older_values(asdict(config))) == config
