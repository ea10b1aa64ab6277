"""Live commands find the team of this machine by themselves, unless a place is given."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path

import pytest

from quadriga.commands.config_options import read_config
from quadriga.commands.parser import build_parser, main
from quadriga.shared.bus.session import Bus
from quadriga.shared.codec import encode
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.members import SIM
from quadriga.shared.messages import Clock
from quadriga.shared.runtime.process_use import read_use
from quadriga.shared.topics import CLOCK
from quadriga.team.endpoint import free_endpoint
from quadriga.team.registry import RunningTeam, team_registered
from tests.listening import WAIT, await_listener

TEAM = load(None, {"team.name": "lab", "team.robots": 2, "bus.endpoint": "tcp/127.3.4.2:7447"})


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of teams, which is not there yet."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path / "quadriga"


def config_of(*words: str) -> Config:
    return read_config(build_parser().parse_args(words))[0]


def add_other(folder: Path, name: str) -> None:
    """A second team, of this process too."""
    use = read_use(os.getpid())
    assert use is not None
    other = RunningTeam(name, "tcp/x:1", "/x/config.toml", "/x", "/", os.getpid(), use.started)
    (folder / "1.json").write_text(json.dumps(asdict(other)))


@pytest.mark.parametrize(
    "words",
    [
        ["estop"],
        ["resume"],
        ["echo", "clock"],
        ["echo", "--rates"],
        ["record"],
        ["doctor"],
        ["fault", "--live", "r1/imu", "stuck"],
        ["echo", "clock", "--team", "lab"],
    ],
)
def test_the_only_team_is_found(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with team_registered(TEAM):
        config = config_of(*words)
    assert (config.team.name, config.team.robots) == ("lab", 2)
    assert config.bus.endpoint == TEAM.bus.endpoint
    assert config.bus.certificates == str(Path("certs").absolute())
    assert capsys.readouterr().err == f"quadriga: team 'lab' of process {os.getpid()}\n"


@pytest.mark.parametrize(
    "words",
    [
        ["walk"],
        ["sim"],
        ["config"],
        ["fault", "r1/imu", "stuck", "--at", "2"],
        ["estop", "--scenario", "flat"],
        ["estop", "--endpoint", "tcp/127.0.0.1:7000"],
        ["estop", "--connect", "tcp/127.0.0.1:7000"],
        ["estop", "--set", "bus.endpoint=tcp/127.0.0.1:7000"],
        ["estop", "--team", "ghost"],
        ["echo", "clock", "--file", "run.mcap"],
        ["doctor", "--here"],
        ["record", "--parent", "1"],
    ],
)
def test_a_place_that_is_given_is_kept(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with team_registered(TEAM):
        assert config_of(*words).bus.endpoint != TEAM.bus.endpoint
    assert capsys.readouterr().err == ""


def test_of_two_teams_one_is_chosen_by_name(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with team_registered(TEAM):
        add_other(folder, "ghost")
        assert config_of("estop", "--team", "lab").bus.endpoint == TEAM.bus.endpoint
        capsys.readouterr()
        assert main(["estop"]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert "got 2 that run on this machine" in err
    assert "--team ghost" in err


def test_a_listener_needs_no_place() -> None:
    """The whole way: a bus somewhere, a file that tells where, a command without options."""
    config = load(None, {"bus.endpoint": free_endpoint()})
    key = CLOCK.key(config.team.name)
    with Bus.open(config.bus, config.team.name, SIM) as bus, team_registered(config):
        listener = subprocess.Popen(
            [sys.executable, "-m", "quadriga", "echo", "clock", "-n", "1"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        await_listener(bus, key)
        bus.publisher(key)(encode(Clock(70, 70_000_000)))
        out, err = listener.communicate(timeout=WAIT)
    assert out.split() == ["0.070", "s", key]
    assert err == f"quadriga: team 'team' of process {os.getpid()}\n"
