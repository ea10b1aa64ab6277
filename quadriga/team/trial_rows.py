"""Trials of one configuration, kept as rows of a file, so that none is walked twice."""

from __future__ import annotations

import json
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, Final

from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import departures, to_toml
from quadriga.shared.errors import ConfigError, name_file_errors
from quadriga.shared.runtime.atomic import write_text
from quadriga.team.run_folder import CONFIG

ROWS: Final = "rows.jsonl"
_ROW: Final = "what a walk left there, a JSON object in a line"
_SEED: Final = "world.seed"  # differs from walk to walk


def open_rows(config: Config, folder: Path) -> list[dict[str, Any]]:
    """What has been walked already in a folder, which is made if there is none.

    Raises:
        ConfigError: it cannot be written to, or holds walks of another configuration or none.
    """
    with _written_to(folder):
        folder.mkdir(parents=True, exist_ok=True)
        rows = read_rows(folder)
        keep_config(config, folder)
    return rows


def append_row(row: dict[str, Any], folder: Path) -> None:
    """Keep a trial.

    Raises:
        ConfigError: the folder cannot be written to.
    """
    with _written_to(folder), (folder / ROWS).open("a", encoding="utf-8") as file:
        file.write(json.dumps(row, ensure_ascii=False) + "\n")


def read_rows(folder: Path) -> list[dict[str, Any]]:
    """What has been walked already.

    Raises:
        ConfigError: a line of the file is no row.
    """
    path = folder / ROWS
    if not path.is_file():
        return []
    with name_file_errors(ConfigError, path, _ROW):
        lines = path.read_text(encoding="utf-8").split("\n")
    return [_read_row(line, f"{path}, line {k}") for k, line in enumerate(lines, 1) if line]


def _read_row(line: str, name: str) -> dict[str, Any]:
    try:
        row = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise ConfigError(name, str(error), _ROW, "written half, or edited by hand?") from None
    if not isinstance(row, dict):
        raise ConfigError(name, type(row).__name__, _ROW, "edited by hand?")
    return row


def keep_config(config: Config, folder: Path) -> None:
    """Write down what all walks in a folder have in common.

    Raises:
        ConfigError: what has been walked there was configured otherwise.
    """
    path = folder / CONFIG
    if not path.is_file():
        write_text(path, to_toml(config, without=(_SEED,)))
        return
    changed = {name: (new, old) for name, new, old, _ in departures(config, load(path))}
    changed.pop(_SEED, None)
    if changed:
        name, (new, old) = next(iter(changed.items()))
        raise ConfigError(
            f"--out {folder}",
            f"walks with {name} = {old!r}, not {new!r}",
            "a new folder, or the same configuration",
        )


def _written_to(folder: Path) -> AbstractContextManager[None]:
    return name_file_errors(ConfigError, f"--out {folder}", "a folder that can be written to")
