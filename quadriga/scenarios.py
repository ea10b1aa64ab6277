"""Scenarios by name: configuration files in deploy/scenarios/, or any other such file."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from shared.errors import ConfigError

_FOLDER: Final = Path(__file__).parent.parent / "deploy" / "scenarios"


def path(name: str) -> Path:
    """The file of a scenario: of that name, or the file itself.

    Raises:
        ConfigError: there is no such scenario.
    """
    file = Path(name) if name.endswith(".toml") else _FOLDER / f"{name}.toml"
    if not file.is_file():
        raise ConfigError("scenario", repr(name), "a scenario's name or a TOML file")
    return file
