"""Where a command's configuration comes from: the options that all have but a few without one."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, Final

from quadriga.commands.command import Given
from quadriga.commands.running import at_its_place, find_running
from quadriga.shared.config.load import build, layers, parse_assignment
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError

# Options that set one key of the configuration each; the key's own documentation is their help.
KEYS: Final = {
    "robots": "team.robots",
    "yokes": "team.yokes",
    "team": "team.name",
    "seconds": "world.duration",
    "mode": "world.mode",
    "seed": "world.seed",
    "terrain": "world.terrain",
    "terrain-height": "world.terrain_height",
    "payload": "world.payload",
    "payload-on": "world.payload_on",
    "push": "world.push",
    "faults": "world.faults",
    "vx": "reference.vx",
    "vy": "reference.vy",
    "wz": "reference.wz",
    "planner": "planner.kind",
    "controller": "team.agent_command",
    "auto-resume": "team.auto_resume",
    "interface": "planner.interface",
    "estimator": "estimator.kind",
    "preset": "controller.preset",
    "endpoint": "bus.endpoint",
}
# What some of them mean for one command alone.
KEYS_OF: Final = {"bridge": {"interface": "bridge.interface"}}
# Commands that take a place on a bus, and `--connect`: reach it through a router elsewhere.
_CONNECTING: Final = frozenset(
    (
        *("sim", "bridge", "agent", "plan", "operate", "record", "estop", "stop", "reset"),
        *("resume", "doctor", "echo", "status", "play"),
    )
)

# Commands without one: what they read is a file with its own, or none at all.
UNCONFIGURED: Final = frozenset(
    ("info", "recover", "report", "export", "experiments", "completion")
)
_DEFAULTS: Final = Config()
_ABOUT: Final = (
    "--scenario NAME, --config FILE, --set SECTION.KEY=VALUE and an option for each key that is "
    "often set, such as --robots: see --help-all, docs/configuration.md."
)


def build_config_options(command: str, *, hidden: bool) -> argparse.ArgumentParser:
    """The parent of a command's parser.

    Args:
        command: its name.
        hidden: show in its help a line instead of these options.
    """
    options = argparse.ArgumentParser(add_help=False)
    options.add_argument("--parent", type=int, default=0, help=argparse.SUPPRESS)
    if command in UNCONFIGURED:
        options.set_defaults(config=None, scenario=None, assignments=[])
        return options
    options.add_argument(
        "--help-all", action="help", help="show the options of the configuration, too, and exit"
    )
    group = options.add_argument_group("configuration", _ABOUT if hidden else None)

    def add(*names: str, help: str, **named: Any) -> None:
        group.add_argument(*names, help=argparse.SUPPRESS if hidden else help, **named)

    add(
        "--scenario",
        metavar="NAME",
        help="start from a scenario's keys; see `quadriga walk --list`; --config and "
        "all other options win over it; a TOML file will do, too",
    )
    add("--config", type=Path, metavar="FILE", help="TOML; see `quadriga config`")
    add(
        "--set",
        action="append",
        default=[],
        metavar="SECTION.KEY=VALUE",
        dest="assignments",
        help="set any key; may be repeated",
    )
    if command in _CONNECTING:
        add(
            "--connect",
            metavar="ENDPOINT",
            help="through the router at tls/HOST:PORT: sets bus.mode to client, and bus.endpoint",
        )
    for option, name in (KEYS | KEYS_OF.get(command, {})).items():
        add(f"--{option}", dest=name, **describe_key(name))
    return options


@cache
def describe_key(name: str) -> Mapping[str, Any]:
    """Type, placeholder and help of the option of a key."""
    section, _, key = name.partition(".")
    group = getattr(_DEFAULTS, section)
    meta = type(group).__dataclass_fields__[key].metadata
    default = getattr(group, key)
    unit = "" if meta["unit"] in ("-", "1") else f" [{meta['unit']}]"
    about = f"{meta['doc']}{unit} ({default})".replace("%", "%%")
    if isinstance(default, bool):
        return {"action": "store_const", "const": True, "help": about}
    shown = "|".join([*meta["choices"], *(["…"] if meta["more"] else [])]) or "X"
    return {"type": type(default), "metavar": shown, "help": about}


def read_config(arguments: argparse.Namespace) -> tuple[Config, Given]:
    """The configuration in force, and what of it is given explicitly.

    Sets `arguments.overrides` to the keys of single options, by their full name. A command for a
    team that runs takes the configuration of the one on this machine, if none is given.

    Raises:
        ConfigError: a key or a value is wrong, a file cannot be read, or several teams run.
    """
    overrides = dict(parse_assignment(text) for text in arguments.assignments)
    for name, value in vars(arguments).items():
        if "." in name and value is not None:
            overrides[name] = value
    overrides |= _connection(arguments, overrides)
    arguments.overrides = overrides
    scenario = arguments.scenario
    running = find_running(arguments, overrides)
    if running is not None:
        given = at_its_place(running, layers(Path(running.config), overrides))
    elif scenario is None:
        given = layers(arguments.config, overrides)
    else:
        from quadriga.team.scenarios import scenario_layers

        given = scenario_layers(scenario, arguments.config, overrides)
    return build(given), given


def _connection(arguments: argparse.Namespace, overrides: Mapping[str, Any]) -> dict[str, str]:
    """The keys that `--connect` sets.

    Raises:
        ConfigError: one of them is given beside it.
    """
    endpoint = getattr(arguments, "connect", None)
    if endpoint is None:
        return {}
    connection = {"bus.mode": "client", "bus.endpoint": endpoint}
    given = sorted(connection.keys() & overrides.keys())
    if given:
        cause = "it sets bus.mode and bus.endpoint"
        raise ConfigError("--connect", f"{given[0]} beside it", "one of the two", cause)
    return connection
