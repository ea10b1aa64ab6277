"""With a controller of one's own nobody plans, whatever a scenario says."""

from __future__ import annotations

from pathlib import Path

import pytest

from quadriga.shared.config.load import build, layers, load
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import config_sha256, to_toml
from quadriga.shared.errors import ConfigError
from quadriga.team import scenarios

LINE = "python walk.py"


def test_a_controller_takes_the_place_of_the_planner() -> None:
    config = load(None, {"team.agent_command": LINE})
    assert (config.team.agent_command, config.planner.kind) == (LINE, "none")
    hard = build(layers(None, {"team.agent_command": LINE}, beneath=scenarios.path("hard-blocks")))
    assert hard.planner.kind == "none"
    assert hard.world.terrain == "boxes"


def test_it_also_does_where_a_file_has_every_key(tmp_path: Path) -> None:
    path = tmp_path / "team.toml"
    path.write_text(to_toml(Config()), encoding="utf-8")
    config = load(path, {"team.agent_command": LINE})
    assert config.planner.kind == "none"
    path.write_text(to_toml(config), encoding="utf-8")
    assert load(path) == config


@pytest.mark.parametrize("keys", [{"planner.kind": "distributed"}, {"planner.kind": "deepc"}])
def test_a_planner_beside_it_is_refused(keys: dict[str, str]) -> None:
    with pytest.raises(ConfigError, match=r"controller 'python walk\.py', expected 'none'"):
        load(None, {"team.agent_command": LINE, **keys})


def test_a_line_that_is_none_is_refused_with_the_configuration() -> None:
    with pytest.raises(ConfigError, match=r"team\.controller: got {robots} in"):
        load(None, {"team.agent_command": "walk {robots}"})


def test_only_with_one_the_hash_is_another() -> None:
    own = load(None, {"planner.kind": "none"})
    assert config_sha256(load(None, {"planner.kind": "none", "team.agent_command": ""})) == (
        config_sha256(own)
    )
    assert config_sha256(load(None, {"team.agent_command": LINE})) != config_sha256(own)
