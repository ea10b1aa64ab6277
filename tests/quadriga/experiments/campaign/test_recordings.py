"""A campaign's trials, walked once more by the commands that its report gives."""

from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path

import pytest

import quadriga.team.walk
from quadriga.commands.parser import main
from quadriga.experiments.campaign.configs import config_file, write_configs
from quadriga.experiments.campaign.recordings import build_command
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import BusConfig, Config
from tests.quadriga.experiments.rows import row

OWN = "tcp/127.0.0.1:7999"


@pytest.mark.parametrize("endpoint", [BusConfig().endpoint, OWN])
def test_trials_are_walked_again_side_by_side_unless_an_endpoint_is_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, endpoint: str
) -> None:
    walked: list[Config] = []

    def walk(config: Config, *_: object, **__: object) -> int:
        walked.append(config)
        return 0

    monkeypatch.setattr(quadriga.team.walk, "walk", walk)
    trial, config = row(seed=7), load(None, {"bus.endpoint": endpoint, "world.duration": 1.5})
    write_configs(tmp_path, {trial.group: config})
    assert load(config_file(tmp_path, trial.group)) == config
    again = shlex.split(build_command(tmp_path, trial))
    for words in (again, again, [*again, "--endpoint", BusConfig().endpoint]):
        assert main(words[1:]) == 0
    first, second, named = (each.bus.endpoint for each in walked)
    assert named == BusConfig().endpoint
    if endpoint == OWN:
        assert first == second == OWN
    else:
        assert len({first, second, named}) == 3
    seeded = replace(config, world=replace(config.world, seed=trial.seed))
    assert replace(walked[0], bus=config.bus) == seeded
