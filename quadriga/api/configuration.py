"""A configuration as a script gives it: a file, a scenario, single keys."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from quadriga.shared.config.load import build, layers, overlay
from quadriga.shared.config.sections import BusConfig, Config
from quadriga.shared.errors import ConfigError
from quadriga.team.scenarios import scenario_layers


def load_config(
    path: str | Path | None = None,
    *,
    scenario: str | None = None,
    set: Mapping[str, Any] | None = None,
) -> Config:
    """The configuration in force: defaults, then a scenario, then a file, then single keys.

    docs/configuration.md has every key with its unit.

    Example:
        >>> config = quadriga.load_config("team.toml", set={"world.seed": 7})
        >>> print(config.world.duration, config.team.robots)

    Args:
        path: a TOML file, as `quadriga config` writes one; None: no file.
        scenario: the name of a scenario, see `quadriga walk --list`, or a TOML file; None: none.
        set: values by `section.key`; they win over all others.

    Raises:
        ConfigError: a file cannot be read, there is no such scenario or key, or a value has the
            wrong type or is out of range.
    """
    return build(read_layers(None if path is None else Path(path), scenario, set or {}))


def read_layers(
    base: Path | Config | None, scenario: str | None, keys: Mapping[str, Any]
) -> dict[str, Any]:
    """What is given explicitly, by section and key.

    Args:
        base: a file, or a whole configuration; None: neither.
        scenario: the name of one, or its file.
        keys: values by `section.key`, which win.

    Raises:
        ConfigError: a file cannot be read, there is no such scenario, or it is given beside a
            whole configuration.
    """
    if isinstance(base, Config):
        if scenario is not None:
            got, cause = f"{scenario!r} beside a Config", "load_config(scenario=…) makes one of it"
            raise ConfigError("scenario", got, "one of the two", cause)
        return overlay(_sections_of(base), keys)
    if scenario is None:
        return layers(base, keys)
    return scenario_layers(scenario, base, keys)


def _sections_of(config: Config) -> dict[str, Any]:
    """All keys of a configuration, without the endpoint if it is the default one."""
    sections: dict[str, Any] = asdict(config)
    if config.bus.endpoint == BusConfig().endpoint:  # else several walks could not go at once
        del sections["bus"]["endpoint"]
    return sections
