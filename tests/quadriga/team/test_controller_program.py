"""A controller is looked for before anything is started, and told what it is for."""

from __future__ import annotations

from pathlib import Path

import pytest

from quadriga.shared.agent_command import PLACES
from quadriga.shared.config.load import load
from quadriga.shared.errors import ConfigError
from quadriga.team.controller_program import become_controller, check_controller, places_of


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("quadriga-no-such-program --fast", "got no program 'quadriga-no-such-program'"),
        ("python no_such_walk.py", "got no file 'no_such_walk.py'"),
    ],
)
def test_what_cannot_be_started_is_told_at_once(line: str, message: str) -> None:
    with pytest.raises(ConfigError, match=r"^team\.agent_command: ") as error:
        check_controller(load(None, {"team.agent_command": line}))
    assert message in str(error.value)


def test_what_can_be_started_passes(tmp_path: Path) -> None:
    script = tmp_path / "walk.py"
    script.touch()
    for line in ("", f"python {script}", "python -m walk", "sh -c true"):
        check_controller(load(None, {"team.agent_command": line}))


def test_every_place_is_told(tmp_path: Path) -> None:
    config = load(None, {"team.name": "lab", "team.agent_command": "walk"})
    places = places_of(config, "r2", tmp_path / "config.toml")
    assert tuple(places) == PLACES
    assert (places["robot"], places["team"], places["mode"]) == ("r2", "lab", "peer")
    assert places["endpoint"] == config.bus.endpoint


def test_a_program_that_is_gone_by_then_is_one_line(tmp_path: Path) -> None:
    config = load(None, {"team.agent_command": "quadriga-no-such-program"})
    with pytest.raises(ConfigError, match="'quadriga-no-such-program': No such file or directory"):
        become_controller(config, places_of(config, "r1", tmp_path / "config.toml"))
