"""A laptop for each robot: its configuration loads, its unit is one that systemd takes."""

from __future__ import annotations

import configparser
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from quadriga.commands.config_options import read_config
from quadriga.commands.parser import build_parser
from quadriga.shared.bus.diagnostics import members
from quadriga.shared.config.load import load

LAPTOP = Path(__file__).parents[2] / "deploy" / "laptop"
UNIT = LAPTOP / "quadriga-agent@.service"
PAGE = LAPTOP.parents[1] / "docs" / "tutorials" / "laptops.md"
README = PAGE.read_text(encoding="utf-8")


def unit() -> configparser.ConfigParser:
    parser = configparser.ConfigParser(strict=False, interpolation=None)
    parser.optionxform = str  # type: ignore[assignment, method-assign]
    parser.read(UNIT, encoding="utf-8")
    return parser


def test_the_configuration_is_one_laptop_for_each_robot() -> None:
    config = load(LAPTOP / "team.toml")
    assert (config.bus.mode, config.team.plant_per_robot) == ("client", True)
    assert members(config) >= {"r1", "r2", "plant_r1", "plant_r2"}


def test_the_unit_starts_the_agent_of_its_instance_and_waits_as_long_as_the_others() -> None:
    words = shlex.split(unit()["Service"]["ExecStart"].replace("%i", "r2"))
    arguments = build_parser().parse_args(words[1:])
    assert (arguments.robot, arguments.config) == ("r2", Path("/etc/quadriga/team.toml"))
    assert arguments.wait <= load(LAPTOP / "team.toml").bus.barrier_timeout
    arguments.config = LAPTOP / "team.toml"
    assert read_config(arguments)[0].bus.certificates == "/etc/quadriga/certs"
    assert unit()["Service"]["LimitRTPRIO"] == "1", "or the agent is late in real time"


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="needs systemd")
def test_systemd_takes_the_unit(tmp_path: Path) -> None:
    text = UNIT.read_text(encoding="utf-8").replace("/opt/quadriga/bin/quadriga", sys.executable)
    path = tmp_path / UNIT.name
    path.write_text(text, encoding="utf-8")
    done = subprocess.run(
        ["systemd-analyze", "verify", f"{tmp_path}/quadriga-agent@r2.service"],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "SYSTEMD_UNIT_PATH": f"{tmp_path}:"},
    )
    said = [line for line in done.stderr.splitlines() if UNIT.stem.rstrip("@") in line]
    assert (done.returncode, said) == (0, [])


COMMANDS = [
    line.partition("#")[0].strip()
    for block in re.findall(r"```sh\n(.*?)```", README, re.S)
    for line in block.splitlines()
    if line.startswith("quadriga ")
]


@pytest.mark.parametrize("command", COMMANDS)
def test_each_command_of_the_page_parses(command: str, tmp_path: Path) -> None:
    """With the file that the page names, of the second team with what the page writes there."""
    (second,) = re.findall(r"```toml\n(.*?)```", README, re.S)
    (tmp_path / "blue.toml").write_text(second, encoding="utf-8")
    files = {
        "/etc/quadriga/team.toml": str(LAPTOP / "team.toml"),
        "blue.toml": str(tmp_path / "blue.toml"),
    }
    words = [files.get(word, word) for word in shlex.split(command)[1:]]
    config, _ = read_config(build_parser().parse_args(words))
    assert config.team.name == ("blue" if "blue.toml" in command else "team")


def test_the_page_names_the_commands_that_a_laptop_needs() -> None:
    assert {line.split()[1] for line in COMMANDS} >= {"doctor", "agent", "bridge", "router"}
