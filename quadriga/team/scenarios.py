"""The named scenarios: configuration files of `deploy/scenarios`, the paper's and beyond."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from quadriga.shared.config.load import layers
from quadriga.shared.errors import ConfigError, did_you_mean, name_file_errors
from quadriga.shared.runtime.places import SCENARIOS

LABEL: Final = "world.scenario"  # the key that carries a scenario's name
_SUFFIX: Final = ".toml"


def names() -> tuple[str, ...]:
    """The scenarios there are, sorted."""
    return tuple(sorted(file.stem for file in SCENARIOS.glob(f"*{_SUFFIX}")))


def path(name: str) -> Path:
    """The file of a scenario.

    Args:
        name: one of `names`, or the path of any configuration file (`….toml`).

    Raises:
        ConfigError: there is no such scenario.
    """
    if name.endswith(_SUFFIX):
        return Path(name)  # whoever reads it complains if it is not there
    if name not in names():
        raise ConfigError(
            "--scenario",
            repr(name),
            "the name of a scenario, or a TOML file",
            did_you_mean(name, names()) or "`quadriga walk --list` lists them",
        )
    return SCENARIOS / f"{name}{_SUFFIX}"


def label(name: str) -> str:
    """What a walk of the scenario is labelled with: its name, or that of its file."""
    return Path(name).stem if name.endswith(_SUFFIX) else name


def scenario_layers(name: str, file: Path | None, overrides: Mapping[str, Any]) -> dict[str, Any]:
    """What is given explicitly, by section and key: the scenario, a file, then overrides on top.

    Args:
        name: of the scenario.
        file: of the configuration that lies over it, if there is one.
        overrides: values by `section.key`.

    Raises:
        ConfigError: there is no such scenario, or a file cannot be read.
    """
    return layers(file, {LABEL: label(name), **overrides}, beneath=path(name))


def description(name: str) -> str:
    """What a scenario is: the comment at the top of its file, in one line; "" if there is none.

    Raises:
        ConfigError: there is no such scenario, or its file cannot be read.
    """
    file = path(name)
    with name_file_errors(ConfigError, file, "a readable TOML file"):
        lines = file.read_text(encoding="utf-8").splitlines()
    comment = []
    for line in lines:
        if not line.startswith("#"):
            break
        comment.append(line.removeprefix("#").strip())
    return " ".join(comment)
