"""A laptop for each robot: its configuration loads, its unit starts the agent."""

from __future__ import annotations

import configparser
import shlex
from pathlib import Path

from quadriga.commands.config_options import read_config
from quadriga.commands.parser import build_parser
from quadriga.shared.bus.diagnostics import members
from quadriga.shared.config.load import load

LAPTOP = Path(__file__).parents[2] / "deploy" / "laptop"
UNIT = LAPTOP / "quadriga-agent@.service"


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
