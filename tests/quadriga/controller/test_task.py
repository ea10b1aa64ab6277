"""What a controller learns from its environment, and what it says where that tells nothing."""

from __future__ import annotations

from pathlib import Path

import pytest

from quadriga.controller import read_task
from quadriga.shared.config.load import load
from quadriga.shared.config.write import to_toml
from quadriga.shared.errors import ConfigError


def test_robot_and_configuration_are_told(tmp_path: Path) -> None:
    config = load(None, {"team.robots": 2, "team.agent_command": "walk"})
    file = tmp_path / "config.toml"
    file.write_text(to_toml(config), encoding="utf-8")
    task = read_task({"QUADRIGA_ROBOT": "r2", "QUADRIGA_CONFIG": str(file)})
    assert (task.robot, task.config) == ("r2", config)
    with pytest.raises(ConfigError, match="QUADRIGA_ROBOT: got 'r3', expected one of r1, r2"):
        read_task({"QUADRIGA_ROBOT": "r3", "QUADRIGA_CONFIG": str(file)})


@pytest.mark.parametrize("given", [{}, {"QUADRIGA_CONFIG": "x.toml"}, {"QUADRIGA_ROBOT": "r1"}])
def test_who_is_started_by_hand_is_told_how(given: dict[str, str]) -> None:
    with pytest.raises(ConfigError, match="quadriga walk --controller"):
        read_task(given)
