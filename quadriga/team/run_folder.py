"""The run folder, made before the walk."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from quadriga.shared.errors import ConfigError, name_file_errors
from quadriga.shared.recording.writer import RECORDING
from quadriga.shared.runtime.clock import format_local, wall_ns

RUNS: Final = Path("runs")
CONFIG: Final = "config.toml"  # the configuration in force, in a run folder


def make_run_dir(out: Path | None) -> Path:
    """A new run folder, or an existing one without a recording.

    Args:
        out: the folder; None takes `runs/<date>-<time>`, with a number if there is one already.

    Raises:
        ConfigError: it holds a recording already, or cannot be made.
    """
    if out is not None and (out / RECORDING).exists():
        raise ConfigError(f"--out {out}", "a folder with a recording", "a new folder")
    with name_file_errors(ConfigError, f"--out {out or RUNS}", "a folder that can be made"):
        if out is None:
            return _make_dated_folder()
        out.mkdir(parents=True, exist_ok=True)
    return out


def check_own_config(given: Path | None, out: Path | None) -> None:
    """Refuse to write the configuration in force over the file that a user wrote.

    Args:
        given: the file of `--config`.
        out: the folder asked for.

    Raises:
        ConfigError: it is `config.toml` in that folder.
    """
    if given is not None and out is not None and given.resolve() == (out / CONFIG).resolve():
        raise ConfigError(
            f"--out {out}",
            f"the folder of --config {given}",
            "another folder",
            f"the configuration in force is written to its {CONFIG}",
        )


def _make_dated_folder() -> Path:
    """`runs/<date>-<time>`, with a number where another walk began in the same second."""
    name, number = format_local("%Y%m%d-%H%M%S", wall_ns()), 1
    while True:
        run_dir = RUNS / (f"{name}-{number}" if number > 1 else name)
        try:
            run_dir.mkdir(parents=True)
        except FileExistsError:
            number += 1
        else:
            return run_dir
