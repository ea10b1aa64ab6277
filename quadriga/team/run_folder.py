"""The run folder, made before the walk."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import to_toml
from quadriga.shared.errors import ConfigError, name_file_errors
from quadriga.shared.recording.metadata import RECORDING
from quadriga.shared.runtime.clock import format_local, wall_ns

RUNS: Final = Path("runs")
_OWN: Final = 0o700  # permissions of a run folder: logs and recordings are nobody else's
CONFIG: Final = "config.toml"  # the configuration in force, in a run folder


def make_run_dir(out: Path | None, config: Config | None = None) -> Path:
    """A run folder, open to its user alone, that no other walk has.

    Args:
        out: the folder; None takes `runs/<date>-<time>`, with a number if there is one already.
        config: is written to its `config.toml`. Whoever creates that file has the folder, so of
            two walks that begin at once one is refused.

    Raises:
        ConfigError: another walk, or a user, has left a recording or a configuration there, or it
            cannot be made.
    """
    if out is not None and (out / RECORDING).exists():
        raise ConfigError(f"--out {out}", "a folder with a recording", "a new folder")
    with name_file_errors(ConfigError, f"--out {out or RUNS}", "a folder that can be made"):
        if out is None:
            out = _make_dated_folder()
        else:
            out.mkdir(_OWN, parents=True, exist_ok=True)
        if config is not None:
            try:
                with (out / CONFIG).open("x", encoding="utf-8") as file:
                    file.write(to_toml(config))
            except FileExistsError:
                cause = "a walk that goes on or has failed, or a file that you wrote"
                raise ConfigError(
                    f"--out {out}", f"a folder with a {CONFIG}", "a new folder", cause
                ) from None
    return out


def _make_dated_folder() -> Path:
    """`runs/<date>-<time>`, with a number where another walk began in the same second."""
    name, number = format_local("%Y%m%d-%H%M%S", wall_ns()), 1
    while True:
        run_dir = RUNS / (f"{name}-{number}" if number > 1 else name)
        try:
            run_dir.mkdir(_OWN, parents=True)
        except FileExistsError:
            number += 1
        else:
            return run_dir
