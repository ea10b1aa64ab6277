"""A configuration as a script gives it is the one that the command line gives."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import quadriga
from quadriga.api.configuration import read_layers
from quadriga.shared.config.load import build
from quadriga.shared.config.sections import BusConfig
from quadriga.team.endpoint import with_free_endpoint


def test_keys_lie_over_a_file_and_that_over_a_scenario(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text("[world]\nseed = 3\nduration = 4.0\n", encoding="utf-8")
    config = quadriga.load_config(str(file), scenario="turn", set={"world.seed": 9})
    assert (config.world.scenario, config.world.seed, config.world.duration) == ("turn", 9, 4.0)
    assert config.reference.wz == quadriga.load_config(scenario="turn").reference.wz != 0.0
    assert quadriga.load_config() == quadriga.Config()
    with pytest.raises(quadriga.ConfigError, match=r"team\.robots: got 0"):
        quadriga.load_config(set={"team.robots": 0})


def test_a_whole_configuration_may_be_changed_and_walks_at_a_place_of_its_own() -> None:
    config = quadriga.load_config(scenario="stairs")
    given = read_layers(config, None, {"planner.preset": "fast", "world.seed": 4})
    assert build(given) == quadriga.load_config(
        scenario="stairs", set={"planner.preset": "fast", "world.seed": 4}
    )
    walks = [with_free_endpoint(build(given), given).bus.endpoint for _ in range(2)]
    assert len({*walks, BusConfig().endpoint}) == 3
    asked = replace(config, bus=replace(config.bus, endpoint="tcp/127.0.0.1:7999"))
    given = read_layers(asked, None, {})
    assert with_free_endpoint(build(given), given).bus.endpoint == "tcp/127.0.0.1:7999"
