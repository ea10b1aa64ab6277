"""The configuration files of a campaign's folder: one for each group, with seed 0."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from quadriga.experiments.plan import Group
from quadriga.shared.config.sections import BusConfig, Config
from quadriga.shared.config.write import to_toml
from quadriga.shared.runtime.atomic import write_text

CONFIGS: Final = "configs"


def config_file(folder: Path, group: Group) -> Path:
    """The whole configuration of a group; `--seed` makes it that of a trial."""
    return folder / CONFIGS / f"{group.name}.toml"


def write_configs(folder: Path, configs: Mapping[Group, Config]) -> None:
    """Write the file of each group."""
    (folder / CONFIGS).mkdir(exist_ok=True)
    for group, config in configs.items():
        # A walk by this file then takes a free endpoint, so that several can go at once.
        usual = config.bus.endpoint == BusConfig().endpoint
        write_text(config_file(folder, group), to_toml(config, ["bus.endpoint"] if usual else []))
